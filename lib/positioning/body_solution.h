// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "closed_form.h"
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

/// Fix of a body, valid if the status is `ok`, and the candidates if it is `ambiguous`.
struct BodySolution {
  FixStatus status;
  BodyFix fix = {};
  int num_candidates = 0;
  std::array<FixCandidate, 6> candidates = {};
};

/// Returns true if the status is `ok`, `ambiguous` or `undetermined`.
bool has_fix(const BodySolution& solution);

/// Maximum number of initial states of a fix, and of its candidates.
inline constexpr std::size_t kMaxInitialStates = 6;

/// Initial states for estimate_body_state().
struct InitialStates {
  /// `ok`, or the reason of failure.
  FixStatus status = FixStatus::degenerate;
  int count = 0;
  std::array<BodyState, kMaxInitialStates> states;

  void add(const InitialStates& others) {
    for (const BodyState& state : others.list()) states[static_cast<std::size_t>(count++)] = state;
  }

  std::span<const BodyState> list() const {
    return {states.data(), static_cast<std::size_t>(count)};
  }
};

/// Observations of the current frame by a camera with the inclination of the prior, rotated to the
/// level frame.
struct LevelSightings {
  std::array<Sighting, kMaxSightings> sightings;
  std::size_t size = 0;
  bool are_lamps_above_horizon = true;

  LevelSightings(const FrameObservations& frame, const Eigen::Matrix3d& level_from_body);
  std::span<const Sighting> observations_span() const { return {sightings.data(), size}; }
};

/// Returns the state of the body for a pose of the camera and the motion of the prior.
BodyState make_body_state(const Pose& camera, const BodyProblem& problem,
                          const Eigen::Matrix3d& lean);

/// Returns true if roll and pitch are so uncertain that a level camera is no initial state.
bool is_roll_pitch_unknown(const BodyPrior& prior);

/// Computes the states below the lamps from three of them.
InitialStates solve_for_three_lamps(const FrameObservations& frame,
                                    const std::array<std::size_t, 3>& lamps,
                                    const BodyProblem& problem);

/// Returns true if the standard deviation of the position is at most the mean distance to the
/// lamps. If motion or tilt are estimated, the limit is a quarter of it.
bool is_position_determined(const FrameObservations& frame, const BodyPrior& prior,
                            const BodyFix& fix);

/// Computes the fix of all lamps, assuming that the identities are correct. Initial states:
///   one lamp   the position at height and yaw of the prior;
///   others     the poses of a level camera (compute_initial_poses()), or if roll and pitch are
///              unknown the poses from the three lamps that are farthest apart
///              (solve_three_lamp_poses()).
/// Statuses:
///   degenerate    the lamps do not determine the position, with known motion, roll and pitch
///   undetermined  lamps and priors do not determine the position
///   ambiguous     another state is nearly as likely: by a factor of exp(-6) or more. Such states
///                 are the candidates.
BodySolution estimate_pose_from_all_lamps(const FrameObservations& frame,
                                          const BodyProblem& problem);

}  // namespace vlp
