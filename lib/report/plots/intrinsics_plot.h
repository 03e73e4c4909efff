// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// Residuals and uncertainty of a lens calibration over the image.
struct IntrinsicsPlot {
  struct Corner {
    Eigen::Vector2d seen_px;
    /// Detected minus projected position.
    Eigen::Vector2d residual_px;
    bool outlier;
  };
  std::string title;
  std::array<int, 2> imager_px;
  /// Corners of all views.
  std::vector<Corner> corners;
  /// Standard deviation of the projection on a regular grid up to the image edges. The values are
  /// row by row from the top left, `cols` (at least two) per row. Values that are not finite are
  /// left blank.
  int cols;
  std::vector<double> sd_px;
  /// MTF50 of equal tiles of the image in cycles per pixel, row by row from the top left,
  /// `mtf50_cols` per row. Tiles that are not finite are left blank. Empty if not measured.
  int mtf50_cols = 0;
  std::vector<double> mtf50 = {};
};

/// Returns the factor by which residuals of this RMS per axis are enlarged in an image of this
/// width.
///
/// The factor is a round number (1, 2 or 5 times a power of ten) that makes the RMS 1/100 to 1/40
/// of the width. 1 if there are no residuals.
double residual_magnification(double rms_px, int width_px);

/// Makes the plot for draw(): maps of the corners, of their enlarged residuals, of the standard
/// deviation of the projection, and of the MTF50 if it was measured.
Drawing make_drawing(const IntrinsicsPlot& plot);

}  // namespace vlp
