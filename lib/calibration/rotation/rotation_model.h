// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "geometry/frames.h"

namespace vlp {

/// Position fix of a camera that rotates in place.
struct RotationFix {
  Pose pose;
  /// Mean height above the camera of the detected lamps that are in the map, m.
  double height_m;
  /// Index of the pivot, at which the rotation axis stays at one position.
  std::size_t pivot;
};

/// Rotation model fitted to position fixes: fix_k = A_spot + e^{jg_k} (e + H_k delta).
struct RotationModelFit {
  std::vector<Eigen::Vector2d> axes_m;
  Eigen::Vector2d lever_arm_m;
  /// Tilt error as an offset of the normalized points (x/z, y/z): the true zenith is seen at
  /// -delta.
  Eigen::Vector2d delta;
  /// Horizontal distance of each fix from its predicted position.
  std::vector<double> residuals_m;
};

/// Fits the rotation model to the fixes by least squares with Cauchy weights, which limit the
/// influence of outliers. If the fixes do not determine the unknowns, returns the solution of
/// minimum norm.
///
/// @param lever_arm  if false, the lever arm is zero, and delta contains its effect
RotationModelFit fit_rotation_model(std::span<const RotationFix> fixes, std::size_t num_pivots,
                                    bool lever_arm);

/// Returns the angular range of the angles: 2 pi minus the largest gap between neighboring angles,
/// rad. Returns 0 for fewer than two angles.
double measure_arc(std::vector<double> angles_rad);

}  // namespace vlp
