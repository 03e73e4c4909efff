// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/body_solution.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "geometry/angles.h"
#include "geometry/symmetric.h"
#include "positioning/three_lamp_poses.h"

namespace vlp {

namespace {

BodyState make_body_state(const FreePose& camera, const BodyProblem& problem) {
  const Eigen::Matrix3d world_from_body = camera.camera_from_world.transpose();
  BodyState state{{camera.position_m - world_from_body * problem.arm_m,
                   std::atan2(world_from_body(1, 0), world_from_body(0, 0))},
                  problem.prior.mean.motion};
  state.motion.inclination = {std::atan2(world_from_body(2, 1), world_from_body(2, 2)),
                              -std::asin(std::clamp(world_from_body(2, 0), -1.0, 1.0))};
  return state;
}

bool is_below_lamps(const FreePose& camera, const std::array<Eigen::Vector3d, 3>& lamps_m) {
  return std::all_of(lamps_m.begin(), lamps_m.end(), [&](const Eigen::Vector3d& lamp_m) {
    return lamp_m.z() > camera.position_m.z();
  });
}

double compute_mean_distance_m(const FrameObservations& frame, const BodyState& state) {
  double sum = 0;
  for (const LampObservation& seen : frame.observations_span()) {
    sum += (seen.lamp_m - state.pose.position_m).norm();
  }
  return sum / static_cast<double>(frame.size);
}

}  // namespace

bool has_fix(const BodySolution& solution) {
  return solution.status == FixStatus::ok || solution.status == FixStatus::ambiguous ||
         solution.status == FixStatus::undetermined;
}

bool is_roll_pitch_unknown(const BodyPrior& prior) {
  constexpr double max_known_sd_rad = 0.15;
  return prior.max_variance(kBodyRoll, 2) > max_known_sd_rad * max_known_sd_rad;
}

LevelSightings::LevelSightings(const FrameObservations& frame,
                               const Eigen::Matrix3d& level_from_body) {
  for (; size < frame.num_current; ++size) {
    const LampObservation& seen = frame.sightings[size];
    const Eigen::Vector3d ray = level_from_body * seen.ray;
    are_lamps_above_horizon = are_lamps_above_horizon && ray.z() > 0;
    sightings[size] = {seen.lamp_m, ray.head<2>() / ray.z()};
  }
}

BodyState make_body_state(const Pose& camera, const BodyProblem& problem,
                          const Eigen::Matrix3d& lean) {
  BodyState state{camera, problem.prior.mean.motion};
  state.pose.position_m -= rotation_about_z(camera.yaw_rad) * lean * problem.arm_m;
  return state;
}

InitialStates solve_for_three_lamps(const FrameObservations& frame,
                                    const std::array<std::size_t, 3>& lamps,
                                    const BodyProblem& problem) {
  std::array<Eigen::Vector3d, 3> points_m, rays;
  for (std::size_t i = 0; i < 3; ++i) {
    points_m[i] = frame.sightings[lamps[i]].lamp_m;
    rays[i] = frame.sightings[lamps[i]].ray;
  }
  const ThreeLampPoses found = solve_three_lamp_poses(points_m, rays);
  InitialStates initial_states;
  for (int i = 0; i < found.count; ++i) {
    const FreePose& pose = found.poses[static_cast<std::size_t>(i)];
    if (!is_below_lamps(pose, points_m)) continue;
    initial_states.states[static_cast<std::size_t>(initial_states.count++)] =
        make_body_state(pose, problem);
  }
  initial_states.status = initial_states.count > 0 ? FixStatus::ok
                          : found.count > 0        ? FixStatus::lamp_below_camera
                                                   : FixStatus::degenerate;
  return initial_states;
}

bool is_position_determined(const FrameObservations& frame, const BodyPrior& prior,
                            const BodyFix& fix) {
  // An estimated tilt or motion adds errors that are not linear in the state.
  const double max_sd_fraction = prior.is_motion_or_tilt_free() ? 0.25 : 1;
  const double limit_m = max_sd_fraction * compute_mean_distance_m(frame, fix.state);
  return fix.covariance.diagonal().head<3>().maxCoeff() < limit_m * limit_m;
}

namespace {

InitialStates compute_level_states(const FrameObservations& frame, const BodyProblem& problem) {
  const BodyPrior& prior = problem.prior;
  const Eigen::Matrix3d lean = level_rotation_from_inclination(prior.mean.motion.inclination);
  const LevelSightings level(frame, lean);
  InitialLevelPoses start{FixStatus::lamp_below_camera};
  if (level.are_lamps_above_horizon && level.size > 1) {
    start = compute_initial_poses(level.observations_span());
  } else if (level.are_lamps_above_horizon && std::isfinite(prior.max_variance(kBodyZ, 2))) {
    const double arm_z_m = (lean * (problem.arm_m - prior.height_point_m)).z();
    const auto pose = solve_for_one_lamp(
        level.sightings.front(), prior.mean.pose.position_m.z() + arm_z_m, prior.mean.pose.yaw_rad);
    if (pose) start = {FixStatus::ok, 1, {*pose}};
  }
  InitialStates states{start.status, start.count, {}};
  for (std::size_t i = 0; static_cast<int>(i) < start.count; ++i) {
    states.states[i] = make_body_state(start.poses[i], problem, lean);
  }
  return states;
}

/// Returns three lamps of the current frame that are far apart and far from collinear.
std::array<std::size_t, 3> select_widest_lamps(const FrameObservations& frame) {
  const auto best = [&](const auto& value) {
    std::size_t found = 0;
    for (std::size_t i = 1; i < frame.num_current; ++i) {
      if (value(i) > value(found)) found = i;
    }
    return found;
  };
  const auto lamp_m = [&](std::size_t i) -> const Eigen::Vector3d& {
    return frame.sightings[i].lamp_m;
  };
  const auto first = best([&](std::size_t i) { return (lamp_m(i) - lamp_m(0)).squaredNorm(); });
  const auto second =
      best([&](std::size_t i) { return (lamp_m(i) - lamp_m(first)).squaredNorm(); });
  const Eigen::Vector3d side_m = lamp_m(second) - lamp_m(first);
  const auto third =
      best([&](std::size_t i) { return side_m.cross(lamp_m(i) - lamp_m(first)).squaredNorm(); });
  return {first, second, third};
}

bool are_below_lamps(const FrameObservations& frame, const BodyProblem& problem,
                     const BodyState& state) {
  const double z_m =
      state.pose.position_m.z() + EvaluatedState(state).body_from_level.col(2).dot(problem.arm_m);
  return std::all_of(frame.sightings.begin(),
                     frame.sightings.begin() + static_cast<std::ptrdiff_t>(frame.size),
                     [&](const LampObservation& seen) { return seen.lamp_m.z() > z_m; });
}

double compute_prior_chi_squared(const BodyState& state, const BodyProblem& problem) {
  return compute_chi_squared({}, problem, state).value_or(0);
}

/// Returns true if the chi-squared of a state is much smaller than its distance from the fix, in
/// standard deviations, implies: a valley of chi-squared connects them, which the covariance of the
/// fix does not describe.
bool is_beyond_linear_range(const BodyState& state, double chi_squared, const BodyFix& fix) {
  constexpr double max_ratio = 3, max_excess = 12;
  Eigen::Vector4d difference;
  difference << state.pose.position_m - fix.state.pose.position_m,
      wrap_angle_rad(state.pose.yaw_rad - fix.state.pose.yaw_rad);
  const auto information =
      invert_positive_definite(Eigen::Matrix4d(fix.covariance.topLeftCorner<4, 4>()));
  if (!information) return true;
  return difference.dot(*information * difference) >
         max_ratio * (chi_squared - fix.chi_squared) + max_excess;
}

/// A state that explains the frame; infinite if there is none.
struct Explanation {
  BodyState state;
  double chi_squared = std::numeric_limits<double>::infinity();
};
/// Fixes from each initial state, and then the initial states themselves.
using Explanations = std::array<Explanation, 2 * kMaxInitialStates>;

/// Sets the states that are nearly as likely as the best one as candidates. `scale` is the ratio of
/// chi-squared to its expectation.
void set_candidates(Explanations& found, double scale, BodySolution& solution) {
  constexpr double unlikely = 12;
  std::ranges::sort(found, {}, &Explanation::chi_squared);
  double sum = 0;
  for (const auto& [state, chi_squared] : found) {
    const double excess = (chi_squared - found.front().chi_squared) / scale;
    if (!(excess < unlikely) || solution.num_candidates == std::ssize(solution.candidates)) break;
    solution.candidates[static_cast<std::size_t>(solution.num_candidates++)] = {
        state, std::exp(-excess / 2)};
    sum += std::exp(-excess / 2);
  }
  for (FixCandidate& candidate : solution.candidates) candidate.likelihood /= sum;
}

/// Returns the fix with the smallest chi-squared from several initial states; `ambiguous` if
/// another state explains the frame nearly as well.
BodySolution select_solution(const InitialStates& initial_states, const FrameObservations& frame,
                             const BodyProblem& problem) {
  constexpr double hopeless = 100, small = 100, same_m = 1e-4;
  std::array<double, kMaxInitialStates> at_start;
  at_start.fill(std::numeric_limits<double>::infinity());
  // Three lamps with unknown roll and pitch: pixels and states are equal in number.
  const bool is_exact = frame.size == 3 && problem.prior.is_tilt_estimated();
  const bool is_single = initial_states.count == 1 && !is_exact;
  if (is_single) at_start[0] = 0;
  for (std::size_t i = 0; !is_single && static_cast<int>(i) < initial_states.count; ++i) {
    const auto chi_squared =
        compute_chi_squared(frame.observations_span(), problem, initial_states.states[i]);
    if (chi_squared) at_start[i] = *chi_squared;
  }
  const double min_chi_squared = *std::min_element(at_start.begin(), at_start.end());
  std::optional<BodyFix> best;
  Explanations found;
  for (std::size_t i = 0; static_cast<int>(i) < initial_states.count; ++i) {
    const BodyState& start = initial_states.states[i];
    if (!(at_start[i] <= hopeless * (min_chi_squared + small))) continue;
    const auto fix = estimate_body_state(frame.observations_span(), problem, start);
    // Such a state that does not converge is close to two solutions.
    if (!fix && is_exact) found[i] = {start, compute_prior_chi_squared(start, problem)};
    if (!fix || !are_below_lamps(frame, problem, fix->state)) continue;
    const bool is_known = std::ranges::any_of(std::span(found).first(i), [&](const auto& other) {
      return std::isfinite(other.chi_squared) &&
             (fix->state.pose.position_m - other.state.pose.position_m).norm() < same_m;
    });
    if (!is_known) found[i] = {fix->state, fix->chi_squared};
    if (!best || (!is_known && fix->chi_squared < best->chi_squared)) best = fix;
  }
  if (!best) return {FixStatus::degenerate};
  if (!is_position_determined(frame, problem.prior, *best)) {
    const bool is_pose_alone = !problem.prior.is_motion_or_tilt_free();
    return {is_pose_alone ? FixStatus::degenerate : FixStatus::undetermined, *best};
  }
  for (std::size_t i = 0; is_exact && static_cast<int>(i) < initial_states.count; ++i) {
    const bool is_other_fix =
        std::isfinite(found[i].chi_squared) && found[i].chi_squared > best->chi_squared;
    if (!is_other_fix && is_beyond_linear_range(initial_states.states[i], at_start[i], *best))
      found[kMaxInitialStates + i] = {initial_states.states[i], at_start[i]};
  }
  BodySolution solution{FixStatus::ok, *best};
  if (is_single) return solution;
  const double freedom = std::max(1.0, 2 * static_cast<double>(frame.size) - 4);
  set_candidates(found, std::max(1.0, best->chi_squared / freedom), solution);
  if (solution.num_candidates > 1) solution.status = FixStatus::ambiguous;
  return solution;
}

/// Computes the fix with free roll and pitch from the three lamps that are farthest apart. If
/// motion or noise hides their pose, tries other lamps in place of the third. Returns std::nullopt
/// if all lamps are collinear.
std::optional<BodySolution> estimate_free_tilt(const FrameObservations& frame,
                                               const BodyProblem& problem) {
  constexpr std::size_t max_tries = 8;
  if (frame.num_current < 3) return std::nullopt;
  const auto [first, second, widest] = select_widest_lamps(frame);
  if (widest == first || widest == second) return std::nullopt;
  std::optional<BodySolution> best;
  std::size_t third = widest;
  for (std::size_t i = 0; i < std::min(frame.num_current, max_tries);
       ++i, third = (third + 1) % frame.num_current) {
    if (third == first || third == second) continue;
    InitialStates initial_states = solve_for_three_lamps(frame, {first, second, third}, problem);
    // Noise may remove the solution of three lamps that is close to the known inclination.
    if (initial_states.count > 0 && !is_roll_pitch_unknown(problem.prior))
      initial_states.add(compute_level_states(frame, problem));
    const BodySolution solution = initial_states.count > 0
                                      ? select_solution(initial_states, frame, problem)
                                      : BodySolution{initial_states.status};
    const bool better =
        !best || (has_fix(solution) &&
                  (!has_fix(*best) || solution.fix.chi_squared < best->fix.chi_squared));
    if (better) best = solution;
    if (has_fix(*best) &&
        compute_reduced_chi_squared(best->fix.chi_squared, frame.size) <= kMaxReducedChiSquared)
      break;
  }
  return best;
}

}  // namespace

BodySolution estimate_pose_from_all_lamps(const FrameObservations& frame,
                                          const BodyProblem& problem) {
  // Three lamps have several solutions even if roll and pitch are roughly known.
  const bool has_several = problem.prior.is_tilt_estimated() && frame.size == 3;
  if (has_several || is_roll_pitch_unknown(problem.prior)) {
    if (const auto solution = estimate_free_tilt(frame, problem); solution && has_fix(*solution)) {
      return *solution;
    }
  }
  const InitialStates start = compute_level_states(frame, problem);
  if (start.count == 0) return {start.status};
  return select_solution(start, frame, problem);
}

}  // namespace vlp
