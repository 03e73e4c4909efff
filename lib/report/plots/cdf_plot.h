// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

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
Drawing make_drawing(const CdfPlot& plot);

}  // namespace vlp
