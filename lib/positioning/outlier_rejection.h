// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "body_solution.h"
#include "fix.h"
#include "least_squares_fix.h"
#include "pose_observations.h"
#include "sighting.h"

namespace vlp {

/// Result of find_largest_consistent_lamp_set(): a pose and the observations that agree with it.
/// `inliers` has a bit per observation, by its index; `count` is the number of set bits.
struct Consensus {
  Pose pose;
  std::bitset<kMaxSightings> inliers;
  std::size_t count;
};

/// Finds the largest set of observations that one pose explains, each with a residual of z of at
/// most `max_residual`. Every pair of lamps proposes its poses. The pose with the most agreeing
/// lamps wins; among equals, the one with the smallest sum of squared residuals. With more than 64
/// lamps the pairs are a fixed selection. Returns std::nullopt without a majority of at least
/// three.
/// @pre at most kMaxSightings observations
std::optional<Consensus> find_largest_consistent_lamp_set(std::span<const Sighting> sightings,
                                                          double max_residual);

/// Least-squares fix of a frame, valid if the status is `ok`.
struct ConsistentFix {
  /// `ok`, or the reason of failure.
  FixStatus status;
  LeastSquaresFix fix;
};

/// Computes the least-squares fix of two lamps or more from compute_initial_pose() and checks it:
///   degenerate    the lamps do not determine it: the standard deviation of the height exceeds the
///                 height
///   inconsistent  of three lamps or more, one has a residual of z above `max_residual`
ConsistentFix estimate_and_check_pose(std::span<const Sighting> sightings, double max_residual);

/// Computes the fix of a frame with two lamps or more whose identities may be wrong.
///
/// A lamp contradicts the fix if its residual exceeds one of two limits:
///   `max_residual_fraction` times the RMS radius of all lamps in the image;
///   0.15 times the smallest distance from a lamp of the frame to its nearest lamp of the map,
///   which excludes confusion of neighbors.
/// On a contradiction, with
///   three or more  that fit the mirror image of the map, the status is `mirrored_map`;
///   four or more   the agreeing majority makes the fix (find_largest_consistent_lamp_set()); the
///   others
///                  are rejected;
///   others         the status is `inconsistent`.
///
/// Lamps below these limits are tested again if their residuals exceed five standard deviations. If
/// the mirror image fits a hundred times better, the status is `mirrored_map`. If all noise is
/// reported, and explains the residuals of a majority a hundred times better, the other lamps are
/// rejected.
ConsistentFix estimate_pose_robust(FrameObservations& frame, double max_residual_fraction);

/// Estimates the state of a body that moves or is tilted, from a frame with at least two lamps. The
/// identities of lamps may be wrong.
///
/// Initial state: if the standard deviation of roll and pitch is at most 0.15 rad, the fix of a
/// level camera (compute_initial_pose). Otherwise the poses from the three lamps that are farthest
/// apart (compute_poses_from_three_lamps). Only poses below the lamps are accepted.
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
                                        const BodyPrior& prior, double max_residual_fraction);

/// Lamps that are rejected, as indices in the frame: none, one or several.
struct OutlierLamps {
  std::array<std::size_t, kMaxSightings> lamps;
  std::size_t count = 0;
};
/// Finds the lamps that contradict the others by more than noise and common errors explain. Assumes
/// that the errors of different lamps are independent.
///
/// While chi-squared exceeds its 1e-4 bound, rejects the lamp whose removal reduces chi-squared
/// most. Returns none if chi-squared exceeds the bound with only three lamps left, or without a
/// majority.
///
/// @param common  covariance of z of each observation from the common errors
OutlierLamps find_outlier_lamps(std::span<const Sighting> sightings,
                                std::span<const Matrix2> common, const LeastSquaresFix& fix);

}  // namespace vlp
