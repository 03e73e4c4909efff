// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// Lamps in the undistorted image while the camera rotates in place: figure 4 of Chen and Guan.
struct RotationPlot {
  /// Positions of a lamp at one camera height, with the fitted ellipse.
  struct Trace {
    int lamp;
    std::vector<Eigen::Vector2d> places_px;
    Eigen::Vector2d center_px;
    Eigen::Vector2d radii_px;
  };
  std::string title;
  std::vector<Trace> traces;
  Eigen::Vector2d rotation_center_px;
  Eigen::Vector2d principal_point_px;
};

/// Makes the plot for draw(): the traces, and next to them, enlarged, the centers of the ellipses,
/// the rotation center and the principal point.
Drawing make_drawing(const RotationPlot& plot);

}  // namespace vlp
