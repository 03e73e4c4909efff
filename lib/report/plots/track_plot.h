// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// Fixes of a camera that drove along a commanded straight line, in the world: the figure 10 of
/// Chen and Guan.
struct TrackPlot {
  std::string title;
  /// Start and end, at different places.
  std::array<Eigen::Vector2d, 2> commanded_m;
  /// In the order of the drive, one or more.
  std::vector<Eigen::Vector2d> fixes_m;
  /// The line fitted to the fixes: two different points of it.
  std::array<Eigen::Vector2d, 2> fitted_m;
};

/// Above the floor, and below how far fixes and fitted line are to the left of the commanded line,
/// in millimetres, along it. Of more than 2,000 fixes some are drawn, evenly in their order.
Drawing drawing_of(const TrackPlot& plot);

}  // namespace vlp
