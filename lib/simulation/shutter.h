// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace vlp {

/// Exposure times of the lines of a sensor. Time 0 is the middle of the middle line's exposure. An
/// exposure is divided into `count` equal parts; `index` is the part that begin_s() and end_s()
/// describe.
struct Shutter {
  double row_time_s, exposure_s;
  int lines;
  int index = 0, count = 1;

  /// Returns the middle of the whole exposure. Lines may be fractional or outside the image.
  double center_s(double line) const { return (line - (lines - 1) / 2.0) * row_time_s; }
  double begin_s(int line) const {
    return center_s(line) + (double(index) / count - 0.5) * exposure_s;
  }
  double end_s(int line) const { return begin_s(line) + exposure_s / count; }
  double middle_s(int line) const { return (begin_s(line) + end_s(line)) / 2; }
};

}  // namespace vlp
