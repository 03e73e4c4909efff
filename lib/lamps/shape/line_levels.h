// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/image/pixel_runs.h"

namespace vlp {

/// Level of a light on a scanline above the dark level, as a fraction of its brightest scanline,
/// and its standard deviation.
struct LineLevel {
  double level, sd;
};

/// Levels of a light on its scanlines, at its middle column, as the ratio to its brightest
/// scanline. Along a scanline the level changes linearly, because of vignetting.
///
/// Scanlines next to the edge of the light have no pixels inside it; their level is predicted. For
/// modulated light it is the mean of the scanlines whole periods away. Its standard deviation
/// combines the scatter of these, the interpolation between scanlines, the uncertainty of the
/// period, and 5 % of the level (20 % with one period), as the face may be dimmer near its edge.
/// For steady light it is the mean of the neighboring scanlines.
class LineLevels {
 public:
  /// Measures the levels of a light. `chords` are its pixels on each scanline of the image `lines`.
  /// @pre `chords` are those of at least eight consecutive scanlines
  LineLevels(const ImageView& lines, const std::vector<PixelRun>& chords,
             const Background& background);

  /// Returns the brightest level above the dark level, in gray levels.
  double max_level_above_dark() const { return brightest_; }
  std::optional<LineLevel> relative_scanline_level(int line) const;
  /// Returns the period of the stripes; 0 for steady light.
  double stripe_period_lines() const { return period_lines_; }
  /// Returns the ratio of the level at a column to that at the middle column.
  double level_at_column_relative_to_middle(double column) const {
    return std::max(0.1, 1 + slope_ * (column - middle_));
  }

 private:
  LineLevel predict_relative_scanline_level(int line) const;

  int first_;
  double brightest_ = 0, middle_ = 0, slope_ = 0;
  std::vector<LineLevel> measured_;
  double period_lines_ = 0, period_sd_ = 0;
};

}  // namespace vlp
