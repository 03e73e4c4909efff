// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/runs.h"

namespace vlp {

/// Level of a light on a line above the dark, as a fraction of the brightest, and its standard
/// deviation.
struct LineLevel {
  double level, sd;
};

/// Levels of a light on lines, in the middle of it; along the lines its level changes linearly, by
/// vignetting. Lines next to its edge have no pixels inside. Stripes repeat, so that their level is
/// that of the lines whole periods away. Its standard deviation combines the scatter of these, the
/// interpolation between lines and the uncertainty of the period. Steady light has the level of the
/// neighbouring lines.
class LineLevels {
 public:
  /// @pre `chords` are those of at least eight consecutive lines.
  LineLevels(const ImageView& lines, const std::vector<Run>& chords, const Background& background);

  /// Returns the brightest level above the dark, in grey levels.
  double brightest() const { return brightest_; }
  std::optional<LineLevel> at(int line) const;
  /// Returns the period of the stripes; 0 for steady light.
  double period_lines() const { return period_lines_; }
  /// Returns the level at a column over that in the middle.
  double share_at(double column) const { return std::max(0.1, 1 + slope_ * (column - middle_)); }

 private:
  LineLevel predicted(int line) const;

  int first_;
  double brightest_ = 0, middle_ = 0, slope_ = 0;
  std::vector<LineLevel> measured_;
  double period_lines_ = 0, period_sd_ = 0;
};

}  // namespace vlp
