// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Errors of fixes on the floor plan, enlarged: the figures 8 and 9 of Chen and Guan.
struct ErrorPlot {
  std::string title;
  /// Of the captures with a fix, in the world.
  struct Fix {
    Eigen::Vector2d truth_m, fix_m;
    /// Name of the capture, for the table.
    std::string image = {};
  };
  std::vector<Fix> fixes;
  /// Where the captures without a fix were.
  std::vector<Eigen::Vector2d> missing_m;
  /// May be empty.
  LampMap lamps;
};

/// How many times as long to draw errors of which nine tenths are no larger, on a floor so wide: a
/// round number (1, 2 or 5 times a power of ten, 1 or more) that makes them a tenth to a 25th of
/// the width; 1 for no errors.
double error_magnification(double p90_m, double width_m);

/// From each true place an arrow towards its fix. Of more than 500 fixes some are drawn, evenly
/// in their order, and the 20 that are furthest off; arrows longer than a quarter of the floor are
/// cut short, dashed and counted. Of more than 200 captures without a fix some are drawn. The table
/// has the ten fixes that are furthest off.
Drawing drawing_of(const ErrorPlot& plot);

}  // namespace vlp
