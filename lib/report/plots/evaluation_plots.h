// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Errors of fixes on the floor plan, enlarged: figures 8 and 9 of Chen and Guan.
struct ErrorPlot {
  std::string title;
  /// Capture with a fix: true horizontal position and position of the fix, in the world, m.
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
/// The factor is 1, 2 or 5 times a power of ten, at least 1. It makes the 90th percentile 1/25 to
/// 1/10 of the width. 1 if there are no errors.
double choose_error_scale(double p90_m, double width_m);

/// Plots an arrow from each true position towards its fix.
///
/// If there are more than 500 fixes, a regular subset in their order and the 20 largest errors are
/// plotted. Arrows longer than a quarter of the floor are cut short, dashed and counted. If there
/// are more than 200 captures without a fix, a subset is plotted. The table lists the ten largest
/// errors.
Drawing draw_fix_errors(const ErrorPlot& plot);

/// Cumulative distribution of errors.
struct CdfPlot {
  std::string title;
  struct Curve {
    std::string label;
    /// Errors in any order, at least one.
    std::vector<double> errors_m;
    /// Median and 90th percentile, marked on the curve.
    double p50_m, p90_m;
  };
  /// Curves, at least one.
  std::vector<Curve> curves;
};

/// Plots the distributions in millimeters. A curve of more than 500 errors passes through 500 of
/// them, the largest included. Errors above four times the largest p90 are clipped, which the axis
/// label mentions.
Drawing draw_error_cdf(const CdfPlot& plot);

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
Drawing draw_line_drive(const TrackPlot& plot);

/// Contributions to the uncertainty of fixes.
struct BudgetPlot {
  std::string title;
  /// Names of the contributions, from the bottom; one to five.
  std::vector<std::string> parts;
  /// Horizontal variances of each fix, m^2, one per contribution. At least one fix, in any order.
  std::vector<std::vector<double>> variances_m2;

  /// Returns the fraction of each contribution in the sum over all fixes.
  std::vector<double> compute_fractions() const;
};

/// Plots one column per fix with its contributions stacked, the smallest total first. If there are
/// more than 200 fixes, 200 are plotted, the largest among them. Contributions that are zero for
/// all fixes are omitted from the key.
Drawing draw_budget(const BudgetPlot& plot);

}  // namespace vlp
