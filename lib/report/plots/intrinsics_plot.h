// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// How views of a board fit the lens that was solved for, over the image.
struct IntrinsicsPlot {
  struct Corner {
    Eigen::Vector2d seen_px;
    /// Seen minus projected.
    Eigen::Vector2d residual_px;
    bool outlier;
  };
  std::string title;
  std::array<int, 2> imager_px;
  /// Of all views.
  std::vector<Corner> corners;
  /// Standard deviation of the projection on a regular grid with the image's edges, row by row from
  /// the top left, `cols` (two or more) to a row; not finite where there is none: left blank.
  int cols;
  std::vector<double> sd_px;
  /// MTF50 of equal parts of the image in cycles per pixel, row by row from the top left,
  /// `mtf50_cols` to a row; parts that are not finite are left blank. Empty: not measured.
  int mtf50_cols = 0;
  std::vector<double> mtf50 = {};
};

/// How many times their length to draw residuals of this rms per axis, for an image so wide: a
/// round number (1, 2 or 5 times a power of ten) that makes the rms 1/100 to 1/40 of the width. 1
/// for no residuals.
double residual_magnification(double rms_px, int width_px);

/// Makes the plot for draw(): side by side the corners, their residuals enlarged, and the standard
/// deviation of the projection, and the MTF50 if it was measured.
Drawing drawing_of(const IntrinsicsPlot& plot);

}  // namespace vlp
