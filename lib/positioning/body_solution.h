// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "fix.h"
#include "pose_estimation.h"
#include "pose_observations.h"

namespace vlp {

/// Returns chi-squared of a fix over its expectation for the reported noise.
inline double compute_reduced_chi_squared(double chi_squared, std::size_t lamps) {
  return chi_squared / static_cast<double>(2 * lamps - 4);
}

/// Largest reduced chi-squared that the reported noise explains: residuals of five standard
/// deviations. A larger value does not reject a fix. It starts the tests of a mirrored map and of
/// outlier lamps, which can replace the fix or reject it.
inline constexpr double kMaxReducedChiSquared = 25;

/// Arm of the camera and prior of the motion.
struct BodyProblem {
  const Eigen::Vector3d& arm_m;
  const BodyPrior& prior;

  bool is_roll_pitch_estimated() const {
    constexpr double gentle_rad = 0.15;
    return prior.inclination_sd_rad > gentle_rad;
  }
};

/// Fix of a body, valid if the status is `ok`.
struct BodySolution {
  FixStatus status;
  BodyFix fix;
};

/// Returns true if the status is `ok`, `ambiguous` or `undetermined`.
bool has_fix(const BodySolution& solution);

/// Initial states for estimate_body_state().
struct InitialStates {
  /// `ok`, or the reason of failure.
  FixStatus status = FixStatus::degenerate;
  int count = 0;
  std::array<BodyState, 4> states;
};

/// Observations of the current frame by a camera with the inclination of the prior, rotated to the
/// level frame. set_sightings_in_level_frame() returns false if a lamp is not above the horizon.
struct LevelSightings {
  std::array<Sighting, kMaxSightings> sightings;
  std::size_t size = 0;

  std::span<const Sighting> observations_span() const { return {sightings.data(), size}; }

  bool set_sightings_in_level_frame(const BodyObservations& frame,
                                    const Eigen::Matrix3d& level_from_body);
};

/// Returns the state of the body for a pose of the camera and the motion of the prior.
BodyState make_body_state_from_camera_pose(const Pose& camera, const BodyProblem& problem,
                                           const Eigen::Matrix3d& lean);

/// Computes the states below the lamps from three of them.
InitialStates compute_initial_body_states_from_three_lamps(const BodyObservations& frame,
                                                           const std::array<std::size_t, 3>& lamps,
                                                           const BodyProblem& problem);

/// Returns true if the standard deviation of the position is at most a quarter of the mean distance
/// to the lamps.
bool is_body_position_determined(const BodyObservations& frame, const BodyFix& fix);

/// Computes the fix of all lamps, assuming that the identities are correct. Initial states: the
/// pose of a level camera (compute_initial_pose()), or if roll and pitch are estimated the poses
/// from the three lamps that are farthest apart (compute_poses_from_three_lamps()).
BodySolution estimate_body_state_from_all_lamps(const BodyObservations& frame,
                                                const BodyProblem& problem);

}  // namespace vlp
