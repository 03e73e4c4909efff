// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// What share of errors is no larger than so much.
struct CdfPlot {
  std::string title;
  struct Curve {
    std::string label;
    /// In any order, one or more.
    std::vector<double> errors_m;
    /// Median and 90th percentile, which are marked on the curve.
    double p50_m, p90_m;
  };
  /// One or more.
  std::vector<Curve> curves;
};

/// In millimetres. Of more than 500 errors a curve goes through 500, the largest among them; errors
/// of more than four times the largest p90 are off the picture, which then says so.
Drawing drawing_of(const CdfPlot& plot);

}  // namespace vlp
