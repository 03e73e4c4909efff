// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "calibration/intrinsics/known_region.h"
#include "camera/lens.h"

namespace vlp {

/// What projection_difference() between a lens and the true one should be.
struct ExpectedDifference {
  /// Root of the expected mean square over the image, per axis.
  double rms_px;
  /// How many independent terms of like size the mean square has: it scatters by sqrt(2 / freedoms)
  /// of itself.
  double freedoms;
};

/// From the covariance of the intrinsics, to first order, for even weights over the image, or over
/// a part of it where there is one. It is less than the projection uncertainty: that counts, too,
/// how far the camera as a whole turns against the boards, which lining two lenses up takes away.
ExpectedDifference expected_difference(const Lens& lens, const std::array<int, 2>& imager_px,
                                       const Eigen::MatrixXd& covariance,
                                       const ImageRegion& region = {});

/// Root of the expected square of the largest difference over the same, which is more than the
/// largest standard deviation of a place, as chance has many places to choose from. By 200 draws,
/// the same ones every time.
double expected_worst_px(const Lens& lens, const std::array<int, 2>& imager_px,
                         const Eigen::MatrixXd& covariance, const ImageRegion& region = {});

}  // namespace vlp
