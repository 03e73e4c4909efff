// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// Contributions to the uncertainty of fixes.
struct BudgetPlot {
  std::string title;
  /// Names of the contributions, from the bottom; one to five.
  std::vector<std::string> parts;
  /// Horizontal variances of each fix, m^2, one per contribution. At least one fix, in any order.
  std::vector<std::vector<double>> variances_m2;

  /// Returns the fraction of each contribution in the sum over all fixes.
  std::vector<double> fractions() const;
};

/// Plots one column per fix with its contributions stacked, the smallest total first. If there are
/// more than 200 fixes, 200 are plotted, the largest among them. Contributions that are zero for
/// all fixes are omitted from the key.
Drawing make_drawing(const BudgetPlot& plot);

}  // namespace vlp
