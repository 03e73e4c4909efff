// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "geometry/circle_fit.h"
#include "report/plots/gnuplot.h"

namespace vlp {

/// Fixes about a known reference point, in the world: Chen and Guan, figure 6.
struct DispersionPlot {
  std::string title;
  /// Errors (fix minus reference point), m, and the smallest circle around them.
  struct Fixes {
    std::vector<Eigen::Vector2d> errors_m;
    Circle circle;
  };
  Fixes before, after;
  /// Rejected fixes: their errors before the correction.
  std::vector<Eigen::Vector2d> outliers_m;
};

/// Makes the plot, in millimeters, for draw().
Drawing make_drawing(const DispersionPlot& plot);

}  // namespace vlp
