// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "../camera/lens.h"
#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "pose_estimation.h"
#include "pose_observations.h"
#include "row_clock.h"

namespace vlp {

/// Cramer-Rao lower bound of a camera that may move and be tilted, predicted from the pixel noise.
struct BodyPoseBound {
  /// Terms of the covariance of (X, Y, Z, yaw), in m and rad: `noise` for known motion, roll and
  /// pitch, the increase due to unknown motion, and the further one due to unknown roll and pitch.
  Matrix4 noise, motion, roll_pitch;
  /// Exact observations of the lamps, and the fix from these and the prior.
  FrameObservations frame;
  BodyFix fix;
};

/// Computes the bound for a camera at `level` that observes `lamps_m`. The mean of the prior is at
/// rest and level.
///
/// @param noise_px   standard deviation of each pixel per axis
/// @return std::nullopt for fewer than two lamps; if these do not determine a fix, or not a unique
///     one with unknown motion or tilt; or if a lamp is not above the camera or not imaged
/// @pre `row_clock` has a value if the prior leaves the motion free
std::optional<BodyPoseBound> compute_pose_crlb(std::span<const Eigen::Vector3d> lamps_m,
                                               const Lens& lens,
                                               const Eigen::Matrix3d& camera_from_level,
                                               const Pose& level, double noise_px,
                                               const BodyPrior& prior,
                                               const std::optional<RowClock>& row_clock);

/// Standard deviations of the error sources of a fix. Errors are normal and independent of each
/// other.
struct ErrorSources {
  /// Standard deviation of a lamp's pixel per axis. Positive.
  double noise_px;
  /// Error of the principal point, per axis; common to all lamps.
  double center_px;
  /// Error of the camera's tilt about the x and the y axis of the level frame; common to all lamps.
  double tilt_rad;
  /// Error of each lamp's position in the map, per axis.
  double lamp_map_m;
};

/// Covariances of (X, Y, Z, yaw) in meters and radians, one for each source.
struct ErrorBudget {
  /// Cramer-Rao lower bound of unbiased estimators at this pixel noise (Chen and Guan, section
  /// 2.2). Let n lamps be at one height H above a camera of focal length f px. With their center
  /// P', S = sum |P_i - P'|^2 and d = |P' - position|:
  ///   sd(X) = sd(Y) = (H/f) noise_px sqrt(1/n + d^2/S)
  ///   sd(yaw) = (H/f) noise_px / sqrt(S),   sd(Z) = H (H/f) noise_px / sqrt(S)
  Matrix4 noise;
  Matrix4 center;
  Matrix4 tilt;
  Matrix4 lamp_map;
  /// Increase of `noise` due to unknown motion, and the further increase due to unknown roll and
  /// pitch (BodyPoseBound). Zero if they are known.
  Matrix4 motion = Matrix4::Zero(), roll_pitch = Matrix4::Zero();

  Matrix4 total_pose_covariance() const {
    return noise + center + tilt + lamp_map + motion + roll_pitch;
  }
};

/// Computes the error budget of a fix at `level`, the pose of a camera that observes `lamps_m`
/// (positions in the world) with equal weights. The mean of the prior is at rest and level; by
/// default the camera is known to be. Propagates each source through the least-squares fix to first
/// order. If the tilt is estimated, an error of the calibrated tilt has almost no effect. Returns
/// std::nullopt as compute_pose_crlb().
/// @pre `row_clock` has a value if the prior leaves the motion free
std::optional<ErrorBudget> compute_fix_budget(std::span<const Eigen::Vector3d> lamps_m,
                                              const Lens& lens, const Pose& level,
                                              const ErrorSources& sources,
                                              const BodyPrior& prior = {},
                                              const std::optional<RowClock>& row_clock = {});

}  // namespace vlp
