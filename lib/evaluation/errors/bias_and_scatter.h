// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "evaluation/errors/fix_errors.h"

namespace vlp {

/// Bias against scatter, over the stations that have two fixes or more.
struct BiasAndScatter {
  struct Station {
    /// Where its first capture was.
    Eigen::Vector2d xy_m;
    std::size_t fixes;
    /// The mean of its horizontal errors e.
    Eigen::Vector2d bias_m;
    /// sqrt(sum |e - bias|^2 / (fixes - 1)): horizontal, of x and y together.
    double sd_m;
  };
  /// In the order of the truth.
  std::vector<Station> stations;
  std::size_t fixes;
  /// sqrt(sum |e - bias of its station|^2 / (fixes - stations)): what repeating a fix changes.
  double scatter_m;
  /// What it does not: root of the mean, over the fixes, of |bias of the station|^2, less what
  /// chance puts into the means: (sum |bias|^2 - stations scatter^2) / fixes, and not below zero.
  double bias_m;
};

/// Of errors_against_truth(). Nothing when no station has two fixes.
std::optional<BiasAndScatter> bias_and_scatter(const std::vector<FixError>& errors,
                                               const std::vector<TruthRow>& truth);

}  // namespace vlp
