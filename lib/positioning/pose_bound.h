// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "../camera/lens.h"
#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "pose_observations.h"
#include "row_clock.h"

namespace vlp {

/// Returns true if velocity, yaw rate or roll and pitch are estimated together with the pose.
bool is_free(const BodyPrior& prior);
/// Returns true if velocity or yaw rate are estimated.
bool may_move(const BodyPrior& prior);

/// Cramer-Rao lower bound of a camera that may move and be tilted, predicted from the pixel noise.
struct BodyLimit {
  /// Covariances of (X, Y, Z, yaw): `noise` for known motion, roll and pitch; `motion` is the
  /// increase due to unknown motion; `lean` the increase due to unknown roll and pitch.
  Matrix4 noise, motion, lean;
  /// Exact observations of the lamps, and the fix from these and the prior.
  BodyObservations frame;
  BodyFix fix;
};

/// Computes the bound for a camera at `level` that observes `lamps_m`. The mean of the prior is at
/// rest and level.
///
/// @param noise_px   standard deviation of each pixel per axis
/// @return std::nullopt if estimate_body_robust() finds no fix, or if the lens does not image a
/// lamp
/// @pre `row_clock` has a value if the prior leaves the motion free
std::optional<BodyLimit> compute_body_limit(std::span<const Eigen::Vector3d> lamps_m,
                                            const Lens& lens,
                                            const Eigen::Matrix3d& camera_from_level,
                                            const Pose& level, double noise_px,
                                            const BodyPrior& prior,
                                            const std::optional<RowClock>& row_clock);

}  // namespace vlp
