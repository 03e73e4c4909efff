// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Estimates the covariance of the intrinsics, in the order of the lens model, by leaving out one
/// view at a time:
///   (n - 1) / n sum over views (d_v - mean d) (d_v - mean d)'
///   n    number of views
///   d_v  change of the intrinsics without view v, to first order; poses and warp change with them
/// Source: Efron, "The Jackknife, the Bootstrap and Other Resampling Plans", 1982.
///
/// @return infinite elements if the remaining views do not determine a lens
/// @pre solution.has_succeeded()
///
/// ProjectionUncertainty assumes independent errors of tags or of corners. This estimate assumes
/// independence of views only. It includes errors common to the corners of a view: a varying warp
/// of the board, a rolling shutter, a lens model that does not fit. With few views it is imprecise,
/// by a relative 1 / sqrt(2 (n - 1)), and often too large.
Eigen::MatrixXd estimate_intrinsics_covariance_by_jackknife(const IntrinsicsSolution& solution);

}  // namespace vlp
