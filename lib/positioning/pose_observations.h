// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "fix.h"
#include "outlier_rejection.h"
#include "pose_estimation.h"

namespace vlp {

/// Lamps observed in one frame, or in several consecutive frames.
struct BodyObservations : LampObservations<BodyObservation> {
  /// Number of observations from the frame of the fix; they are at the start of the arrays. All
  /// other observations are from earlier frames.
  std::size_t num_current = 0;
};

/// Fix of a body, valid if the status is `ok`.
struct BodySolution {
  FixStatus status;
  BodyFix fix;
};

/// Estimates the state of a body that moves or is tilted, from a frame with at least two lamps. The
/// identities of lamps may be wrong.
///
/// Initial state: if the standard deviation of roll and pitch is at most 0.15 rad, the fix of a
/// level camera (compute_initial_pose). Otherwise the poses from the three lamps that are farthest
/// apart (compute_three_lamp_poses). Only poses below the lamps are accepted.
///
/// Checks residuals, mirrored maps and majorities as estimate_pose_robust() does for level cameras.
/// The residual limits apply to distances in meters across the rays; estimate_pose_robust() applies
/// them to z. If the noise does not explain the residuals, a lamp is rejected if only its removal
/// does.
///
/// Additional statuses:
///   undetermined  lamps and priors leave the position uncertain by more than a quarter of the
///                 distance to the lamps: two lamps, or three collinear ones, with free roll and
///                 pitch
///   ambiguous     another solution is nearly as likely: by a factor of exp(-6) or more
///   inconsistent  velocity, yaw rate or roll and pitch differ from the prior by more than five
///                 standard deviations
BodySolution estimate_body_state_robust(BodyObservations& frame,
                                        const Eigen::Vector3d& arm_in_body_m,
                                        const BodyPrior& prior, double max_residual_share);

}  // namespace vlp
