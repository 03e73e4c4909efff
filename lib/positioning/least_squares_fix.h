// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "sighting.h"

namespace vlp {

struct LeastSquaresFix {
  Pose pose;
  /// Of (X, Y, Zs, g) in metres and radians: (J^T W J)^-1 for the pixels' sigma_px.
  Matrix4 covariance;
  /// Sum of the squared pixel residuals over sigma_px^2; 2n - 4 degrees of freedom.
  double chi_squared;
  /// Root of the mean squared distance, in the image, of the lamps from where the fix sees them.
  double residual_px;
};

/// The fix of least squares: any number of lamps, two or more, at any heights, each weighted by
/// its sigma_px and by how the lens maps its surroundings. Minimizes
///   sum |d_pixel_d_z (z - e^{-jg} (p - s) / H)|^2 / sigma_px^2
/// over (X, Y, Zs, g) by Gauss-Newton steps, halved where they do not help, from `start`.
/// Nothing when a lamp is not above `start`, when the lamps do not determine the state, or when
/// 50 steps do not converge.
std::optional<LeastSquaresFix> fix_least_squares(std::span<const Sighting> sightings,
                                                 const Pose& start);

/// What a small rotation of the level frame about each of its axes does to (X, Y, Zs, g) of `fix`,
/// which fix_least_squares() gave for `sightings`: metres and radians per radian.
Eigen::Matrix<double, 4, 3> rotation_effect(std::span<const Sighting> sightings,
                                            const LeastSquaresFix& fix);

}  // namespace vlp
