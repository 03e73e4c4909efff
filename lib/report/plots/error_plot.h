// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Errors of fixes on the floor plan, enlarged: figures 8 and 9 of Chen and Guan.
struct ErrorPlot {
  std::string title;
  /// Capture with a fix: true position and fix, in the world.
  struct Fix {
    Eigen::Vector2d truth_m, fix_m;
    /// Image name of the capture, for the table.
    std::string image = {};
  };
  std::vector<Fix> fixes;
  /// True positions of the captures without a fix.
  std::vector<Eigen::Vector2d> missing_m;
  /// Lamps on the plan; may be empty.
  LampMap lamps;
};

/// Returns the factor by which errors are enlarged on a floor of the width `width_m`, given their
/// 90th percentile.
///
/// The factor is a round number (1, 2 or 5 times a power of ten, at least 1) that makes the 90th
/// percentile 1/25 to 1/10 of the width. 1 if there are no errors.
double error_magnification(double p90_m, double width_m);

/// Plots an arrow from each true position towards its fix.
///
/// If there are more than 500 fixes, a regular subset in their order and the 20 largest errors are
/// plotted. Arrows longer than a quarter of the floor are cut short, dashed and counted. If there
/// are more than 200 captures without a fix, a subset is plotted. The table lists the ten largest
/// errors.
Drawing make_drawing(const ErrorPlot& plot);

}  // namespace vlp
