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

/// How bright a light is on a line, above the dark and over the brightest, and its standard
/// deviation.
struct LineLevel {
  double level, sd;
};

/// The levels that a light has on lines, in the middle of it; across the lines its level changes
/// evenly, as vignetting makes it. Also on lines next to its edge, where it has no pixels inside:
/// stripes repeat, so that the level is that of the lines whole periods away, with the
/// scatter of those, what the line between two of them may miss and what the period's own
/// uncertainty is worth as the standard deviation. Of steady light it is that of the lines next to
/// it.
class LineLevels {
 public:
  /// `chords` are of lines that follow one another, of which there are eight at least.
  LineLevels(const ImageView& lines, const std::vector<Run>& chords, const Background& background);

  /// Above the dark, in grey levels.
  double brightest() const { return brightest_; }
  std::optional<LineLevel> at(int line) const;
  /// Period of the stripes; 0 for steady light.
  double period_lines() const { return period_lines_; }
  /// The level at that column over that in the middle.
  double share_at(double column) const { return std::max(0.1, 1 + slope_ * (column - middle_)); }

 private:
  LineLevel predicted(int line) const;

  int first_;
  double brightest_ = 0, middle_ = 0, slope_ = 0;
  std::vector<LineLevel> measured_;
  double period_lines_ = 0, period_sd_ = 0;
};

}  // namespace vlp
