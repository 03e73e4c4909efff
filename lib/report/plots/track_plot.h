// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// Fixes of a camera on a drive along a commanded straight line, in the world: figure 10 of Chen
/// and Guan.
struct TrackPlot {
  std::string title;
  /// Start and end, which differ.
  std::array<Eigen::Vector2d, 2> commanded_m;
  /// Fixes in the order of the drive, at least one.
  std::vector<Eigen::Vector2d> fixes_m;
  /// Two different points of the line fitted to the fixes.
  std::array<Eigen::Vector2d, 2> fitted_m;
};

/// Plots the lines and fixes on the floor. A second plot shows the distances of fixes and fitted
/// line to the left of the commanded line, in mm, along it. If there are more than 2,000 fixes, a
/// regular subset in their order is plotted.
Drawing make_drawing(const TrackPlot& plot);

}  // namespace vlp
