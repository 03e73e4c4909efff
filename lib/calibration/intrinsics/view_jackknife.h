// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calibration/intrinsics/intrinsics.h"

namespace vlp {

/// Covariance of the intrinsics by how much they change when each view in turn is left out
/// (Efron, "The Jackknife, the Bootstrap and Other Resampling Plans", 1982):
///   (n - 1) / n sum over views (d_v - mean d) (d_v - mean d)',
/// with d_v the change to first order, poses and warp along. ProjectionUncertainty takes the errors
/// of different tags for independent, or those of all corners; this one only those of different
/// views, so that what a view's corners have in common counts: a board that bends otherwise, a
/// rolling shutter, a lens model that does not fit. With few views it is rough, by
/// 1 / sqrt(2 (n - 1)), and often too large. Infinite when the rest does not determine a lens.
/// Precondition: solution.ok().
Eigen::MatrixXd covariance_by_views(const IntrinsicsSolution& solution);

}  // namespace vlp
