// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "calibration/intrinsics/valid_region.h"
#include "camera/lens.h"

namespace vlp {

/// Expected difference between the projections of an estimated lens and the true one
/// (compute_projection_difference()).
struct ExpectedDifference {
  /// Expected RMS distance between the projections of the two lenses over the image, per axis, px.
  double rms_px;
  /// Effective number of independent terms of similar size in the mean square, whose relative
  /// standard deviation is sqrt(2 / degrees_of_freedom).
  double degrees_of_freedom;
};

/// Computes the expected difference from the covariance of the intrinsics, to first order. Weights
/// are uniform over the image, or over `region` if it is not empty.
///
/// The difference is smaller than the projection uncertainty, which includes rotations of the
/// camera relative to the boards. Aligning two lenses removes such rotations. Infinite if the
/// covariance is not finite.
ExpectedDifference compute_expected_projection_difference(const Lens& lens,
                                                          const std::array<int, 2>& imager_px,
                                                          const Eigen::MatrixXd& covariance,
                                                          const ImageRegion& region = {});

/// Estimates the root of the expected square of the largest difference over the same pixels, px,
/// from 200 random draws with a fixed seed.
///
/// It exceeds the largest standard deviation of a single pixel, because the maximum is over many
/// pixels. Infinite if the covariance is not finite.
double estimate_max_expected_difference_px(const Lens& lens, const std::array<int, 2>& imager_px,
                                           const Eigen::MatrixXd& covariance,
                                           const ImageRegion& region = {});

}  // namespace vlp
