// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace vlp {

/// When each line of the sensor collects light, around the time 0 of a capture: the middle of the
/// middle line's exposure. `index` of `count` is the part of the exposure that is looked at.
struct Shutter {
  double row_time_s, exposure_s;
  int lines;
  int index = 0, count = 1;

  /// Of the whole exposure; lines may lie outside the image or between two.
  double center_s(double line) const { return (line - (lines - 1) / 2.0) * row_time_s; }
  double begin_s(int line) const {
    return center_s(line) + (double(index) / count - 0.5) * exposure_s;
  }
  double end_s(int line) const { return begin_s(line) + exposure_s / count; }
  double middle_s(int line) const { return (begin_s(line) + end_s(line)) / 2; }
};

}  // namespace vlp
