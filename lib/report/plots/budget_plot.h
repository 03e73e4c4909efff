// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// What the uncertainty of fixes comes from.
struct BudgetPlot {
  std::string title;
  /// From the bottom; one to five.
  std::vector<std::string> parts;
  /// Horizontal variances of each fix in m^2, one a part; in any order, one or more.
  std::vector<std::vector<double>> variances_m2;

  /// Of the sum over all fixes, what is of each part.
  std::vector<double> shares() const;
};

/// A column a fix, its parts stacked, the smallest first; of more than 200 fixes 200, the largest
/// among them. Parts that no fix has anything of are left out of the key.
Drawing drawing_of(const BudgetPlot& plot);

}  // namespace vlp
