// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/valid_region.h"

namespace vlp {

/// Effect of an aspect error of the printed board on a lens: the change if the board is wider than
/// stated, at the stated height.
struct AspectErrorEffect {
  /// Change of each intrinsic, in the order of the lens model, due to an error of the board's
  /// aspect. The error is one standard deviation: the board is wider than stated by the fraction
  /// sqrt(2) print_sd.
  Eigen::VectorXd intrinsics;
  /// Change of projections over the image, rms per axis, in px.
  double rms_px;
  /// Change of projections over the region where the lens is known, mean and largest, in px.
  double mean_in_region_px, worst_in_region_px;
};

/// Computes the effect of one standard deviation of the ratio of the board's width to its height,
/// sqrt(2) print_sd. A common scale error of the board changes distances only, not the lens.
///
/// The problem is solved again from the solution, with each measured corner moved by
///   p(x) - p(D x),  D = diag(1 + sqrt(2) print_sd, 1, 1),
/// where x are the points of the boards at the solution and p is the projection. To first order
/// this equals a solve with the points D x. Edge shifts, weights and outliers are kept.
///
/// @param print_sd  Board::print_sd, > 0
/// @param region    region where the lens is known (CalibrationReport::region)
/// @return std::nullopt if that solve fails
std::optional<AspectErrorEffect> estimate_aspect_effect(const IntrinsicsSolution& solution,
                                                        double print_sd,
                                                        const ImageRegion& region = {});

}  // namespace vlp
