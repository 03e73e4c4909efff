// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/pose_observations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>
#include <optional>

#include "geometry/angles.h"
#include "positioning/closed_form.h"
#include "positioning/three_lamp_poses.h"

namespace vlp {
namespace {

using Agreeing = std::bitset<kMaxSightings>;

// As in estimate_pose_robust().
constexpr double kUnexplained = 25;
constexpr double kMuchBetter = 100;

/// Arm of the camera and prior of the motion.
struct Problem {
  const Eigen::Vector3d& arm_m;
  const BodyPrior& prior;

  bool is_roll_pitch_estimated() const {
    constexpr double gentle_rad = 0.15;
    return prior.inclination_sd_rad > gentle_rad;
  }
};

struct InitialStates {
  /// `ok`, or the reason of failure.
  FixStatus status = FixStatus::degenerate;
  int count = 0;
  std::array<BodyState, 4> states;
};

/// Observations of the current frame by a camera with the inclination of the prior, rotated to the
/// level frame. fill() returns false if a lamp is not above the horizon.
struct LevelSightings {
  std::array<Sighting, kMaxSightings> sightings;
  std::size_t size = 0;

  std::span<const Sighting> as_span() const { return {sightings.data(), size}; }

  bool fill(const BodyObservations& frame, const Eigen::Matrix3d& level_from_body) {
    for (; size < frame.num_current; ++size) {
      const BodyObservation& seen = frame.sightings[size];
      const Eigen::Vector3d ray = level_from_body * seen.ray;
      if (!(ray.z() > 0)) return false;
      sightings[size] = {seen.lamp_m, ray.head<2>() / ray.z(), Matrix2::Identity(), seen.sigma_px};
    }
    return true;
  }
};

BodyState make_body_state(const Pose& camera, const Problem& problem, const Eigen::Matrix3d& lean) {
  BodyState state{camera, problem.prior.mean};
  state.pose.position_m -= rotation_about_z(camera.yaw_rad) * lean * problem.arm_m;
  return state;
}

InitialStates compute_level_state(const BodyObservations& frame, const Problem& problem) {
  const Eigen::Matrix3d lean = level_from_inclination(problem.prior.mean.inclination);
  LevelSightings level;
  if (!level.fill(frame, lean)) return {FixStatus::lamp_below_camera, 0, {}};
  const InitialPose start = compute_initial_pose(level.as_span());
  if (start.status != FixStatus::ok) return {start.status, 0, {}};
  return {FixStatus::ok, 1, {make_body_state(start.pose, problem, lean)}};
}

BodyState make_body_state(const FreePose& camera, const Problem& problem) {
  const Eigen::Matrix3d world_from_body = camera.camera_from_world.transpose();
  BodyState state{{camera.position_m - world_from_body * problem.arm_m,
                   std::atan2(world_from_body(1, 0), world_from_body(0, 0))},
                  problem.prior.mean};
  state.motion.inclination = {std::atan2(world_from_body(2, 1), world_from_body(2, 2)),
                              -std::asin(std::clamp(world_from_body(2, 0), -1.0, 1.0))};
  return state;
}

bool is_below_lamps(const FreePose& camera, const std::array<Eigen::Vector3d, 3>& lamps_m) {
  return std::all_of(lamps_m.begin(), lamps_m.end(), [&](const Eigen::Vector3d& lamp_m) {
    return lamp_m.z() > camera.position_m.z();
  });
}

/// Computes the states below the lamps from three of them.
InitialStates compute_initial_states(const BodyObservations& frame,
                                     const std::array<std::size_t, 3>& lamps,
                                     const Problem& problem) {
  std::array<Eigen::Vector3d, 3> points_m, rays;
  for (std::size_t i = 0; i < 3; ++i) {
    points_m[i] = frame.sightings[lamps[i]].lamp_m;
    rays[i] = frame.sightings[lamps[i]].ray;
  }
  const ThreeLampPoses found = compute_three_lamp_poses(points_m, rays);
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

/// Returns three lamps of the current frame that are far apart and far from collinear.
std::array<std::size_t, 3> find_widest_lamps(const BodyObservations& frame) {
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

/// Returns the distance of a lamp from its observed ray; infinity if the lamp is behind it.
double distance_from_ray(const BodyObservation& seen, const Problem& problem,
                         const EvaluatedState& body) {
  const Eigen::Vector3d q = body.lamp_in_body(seen.lamp_m, seen.time_s) - problem.arm_m;
  const double depth_m = seen.ray.dot(q);
  return depth_m > 0 ? (q - depth_m * seen.ray).norm() : std::numeric_limits<double>::infinity();
}

double distance_m(const BodyObservations& frame, const BodyState& state) {
  double sum = 0;
  for (const BodyObservation& seen : frame.as_span()) {
    sum += (seen.lamp_m - state.pose.position_m).norm();
  }
  return sum / static_cast<double>(frame.size);
}

bool is_determined(const BodyObservations& frame, const BodyFix& fix) {
  constexpr double max_sd_fraction = 0.25;
  const double limit_m = max_sd_fraction * distance_m(frame, fix.state);
  return fix.covariance.diagonal().head<3>().maxCoeff() < limit_m * limit_m;
}

bool are_below_lamps(const BodyObservations& frame, const Problem& problem,
                     const BodyState& state) {
  const double z_m = state.pose.position_m.z() +
                     (level_from_inclination(state.motion.inclination) * problem.arm_m).z();
  return std::all_of(frame.sightings.begin(),
                     frame.sightings.begin() + static_cast<std::ptrdiff_t>(frame.size),
                     [&](const BodyObservation& seen) { return seen.lamp_m.z() > z_m; });
}

/// Returns the fix with the smallest chi-squared from several initial states; `ambiguous` if
/// another fix explains the frame nearly as well.
BodySolution find_best_body_solution(const InitialStates& initial_states,
                                     const BodyObservations& frame, const Problem& problem) {
  constexpr double hopeless = 100, small = 100, unlikely = 12, same_m = 1e-4;
  std::array<double, 4> at_start;
  at_start.fill(std::numeric_limits<double>::infinity());
  if (initial_states.count == 1) at_start[0] = 0;
  for (std::size_t i = 0; initial_states.count > 1 && static_cast<int>(i) < initial_states.count;
       ++i) {
    const auto chi_squared = compute_chi_squared(frame.as_span(), problem.arm_m, problem.prior,
                                                 initial_states.states[i]);
    if (chi_squared) at_start[i] = *chi_squared;
  }
  const double min_chi_squared = *std::min_element(at_start.begin(), at_start.end());
  std::optional<BodyFix> best;
  double second = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; static_cast<int>(i) < initial_states.count; ++i) {
    if (!(at_start[i] <= hopeless * (min_chi_squared + small))) continue;
    const auto fix = estimate_body_state(frame.as_span(), problem.arm_m, problem.prior,
                                         initial_states.states[i]);
    if (!fix || !are_below_lamps(frame, problem, fix->state)) continue;
    if (!best) {
      best = fix;
      continue;
    }
    const bool same = (fix->state.pose.position_m - best->state.pose.position_m).norm() < same_m;
    if (same) continue;
    second = std::min(second, std::max(fix->chi_squared, best->chi_squared));
    if (fix->chi_squared < best->chi_squared) best = fix;
  }
  if (!best) return {FixStatus::degenerate, {}};
  if (!is_determined(frame, *best)) return {FixStatus::undetermined, *best};
  const double freedom = std::max(1.0, 2 * static_cast<double>(frame.size) - 4);
  const double scale = std::max(1.0, best->chi_squared / freedom);
  const bool ambiguous = second - best->chi_squared < unlikely * scale;
  return {ambiguous ? FixStatus::ambiguous : FixStatus::ok, *best};
}

double compute_reduced_chi_squared(const BodyFix& fix, const BodyObservations& frame) {
  return fix.chi_squared / static_cast<double>(2 * frame.size - 4);
}

bool has_fix(const BodySolution& solution) {
  return solution.status == FixStatus::ok || solution.status == FixStatus::ambiguous ||
         solution.status == FixStatus::undetermined;
}

/// Computes the fix with free roll and pitch from the three lamps that are farthest apart. If
/// motion or noise hides their pose, tries other lamps in place of the third. Returns std::nullopt
/// if all lamps are collinear.
std::optional<BodySolution> estimate_body_with_free_tilt(const BodyObservations& frame,
                                                         const Problem& problem) {
  constexpr std::size_t max_tries = 8;
  if (frame.num_current < 3) return std::nullopt;
  const auto [first, second, widest] = find_widest_lamps(frame);
  if (widest == first || widest == second) return std::nullopt;
  std::optional<BodySolution> best;
  std::size_t third = widest;
  for (std::size_t i = 0; i < std::min(frame.num_current, max_tries);
       ++i, third = (third + 1) % frame.num_current) {
    if (third == first || third == second) continue;
    const InitialStates initial_states =
        compute_initial_states(frame, {first, second, third}, problem);
    const BodySolution solution = initial_states.count > 0
                                      ? find_best_body_solution(initial_states, frame, problem)
                                      : BodySolution{initial_states.status, {}};
    const bool better =
        !best || (has_fix(solution) &&
                  (!has_fix(*best) || solution.fix.chi_squared < best->fix.chi_squared));
    if (better) best = solution;
    if (has_fix(*best) && compute_reduced_chi_squared(best->fix, frame) <= kUnexplained) break;
  }
  return best;
}

/// Computes the fix of all lamps, assuming that the identities are correct.
BodySolution estimate_body_from_all_lamps(const BodyObservations& frame, const Problem& problem) {
  if (problem.is_roll_pitch_estimated()) {
    if (const auto solution = estimate_body_with_free_tilt(frame, problem);
        solution && has_fix(*solution)) {
      return *solution;
    }
  }
  const InitialStates start = compute_level_state(frame, problem);
  if (start.count == 0) return {start.status, {}};
  return find_best_body_solution(start, frame, problem);
}

/// Returns the largest accepted distance of a lamp from its ray, in m.
double compute_residual_limit(const BodyObservations& frame, double max_residual_share) {
  constexpr double max_neighbor_fraction = 0.15;
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  const double n = static_cast<double>(frame.size);
  for (const BodyObservation& seen : frame.as_span()) mean_m += seen.lamp_m / n;
  double sum = 0, nearest_m = frame.nearest_m[0];
  for (std::size_t i = 0; i < frame.size; ++i) {
    sum += (frame.sightings[i].lamp_m - mean_m).squaredNorm();
    nearest_m = std::min(nearest_m, frame.nearest_m[i]);
  }
  return std::min(max_residual_share * std::sqrt(sum / n), max_neighbor_fraction * nearest_m);
}

/// Returns true if the motion is within five standard deviations of the prior.
bool is_within_prior(const BodyPrior& prior, const BodyMotion& motion) {
  constexpr double sigmas = 5;
  const Inclination &lean = motion.inclination, &mean = prior.mean.inclination;
  const double tilt_rad = std::hypot(wrap_angle_rad(lean.roll_rad - mean.roll_rad),
                                     wrap_angle_rad(lean.pitch_rad - mean.pitch_rad));
  return (motion.velocity_m_per_s - prior.mean.velocity_m_per_s).norm() <=
             sigmas * prior.velocity_sd_m_per_s &&
         std::abs(motion.yaw_rate_rad_per_s - prior.mean.yaw_rate_rad_per_s) <=
             sigmas * prior.yaw_rate_sd_rad_per_s &&
         tilt_rad <= sigmas * prior.inclination_sd_rad;
}

Agreeing find_agreeing_observations(const BodyState& state, const BodyObservations& frame,
                                    const Problem& problem, double limit_m) {
  Agreeing agreeing;
  const EvaluatedState body(state);
  for (std::size_t i = 0; i < frame.size; ++i) {
    agreeing[i] = distance_from_ray(frame.sightings[i], problem, body) <= limit_m;
  }
  return agreeing;
}

bool is_consistent(const BodySolution& solution, const BodyObservations& frame,
                   const Problem& problem, double limit_m) {
  return has_fix(solution) && is_within_prior(problem.prior, solution.fix.state.motion) &&
         find_agreeing_observations(solution.fix.state, frame, problem, limit_m).count() ==
             frame.size;
}

BodyObservations select_lamps(const BodyObservations& frame, const Agreeing& agreeing) {
  BodyObservations remaining = frame;
  remaining.size = remaining.num_current = 0;
  for (std::size_t i = 0; i < frame.size; ++i) {
    if (agreeing[i]) {
      remaining.sightings[remaining.size] = frame.sightings[i];
      remaining.ids[remaining.size] = frame.ids[i];
      remaining.nearest_m[remaining.size++] = frame.nearest_m[i];
      remaining.num_current += i < frame.num_current;
    } else if (i < frame.num_current) {
      remaining.rejected_ids[static_cast<std::size_t>(remaining.rejected_lamps++)] = frame.ids[i];
    }
  }
  return remaining;
}

/// Returns the frame with the mirror image of the map.
BodyObservations mirror_lamp_positions(BodyObservations frame) {
  for (std::size_t i = 0; i < frame.size; ++i) frame.sightings[i].lamp_m.y() *= -1;
  return frame;
}

/// Finds the largest set of lamps that agree with a state of free roll and pitch, at rest. Every
/// triple of lamps proposes its states.
std::optional<Agreeing> find_majority_with_free_tilt(const BodyObservations& frame,
                                                     const Problem& problem, double limit_m) {
  constexpr std::size_t few = 12, at_least = 4;
  const std::size_t n = frame.num_current, stride = n <= few ? 1 : n * n * n / (few * few * few);
  Agreeing best;
  std::size_t turn = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (turn++ % stride != 0) continue;
        const InitialStates initial_states = compute_initial_states(frame, {i, j, k}, problem);
        for (std::size_t m = 0; static_cast<int>(m) < initial_states.count; ++m) {
          const Agreeing agreeing =
              find_agreeing_observations(initial_states.states[m], frame, problem, limit_m);
          if (agreeing.count() > best.count()) best = agreeing;
        }
      }
    }
  }
  if (best.count() < at_least || 2 * best.count() <= frame.size) return std::nullopt;
  return best;
}

/// Finds the largest set of lamps that agree with a state with the inclination of the prior.
std::optional<Agreeing> find_majority_if_level(const BodyObservations& frame,
                                               const Problem& problem, double limit_m) {
  const Eigen::Matrix3d lean = level_from_inclination(problem.prior.mean.inclination);
  LevelSightings level;
  if (!level.fill(frame, lean)) return std::nullopt;
  // The limit is converted to z by the ratio of the distances between lamps.
  double sum_z = 0, sum_m = 0;
  const Sighting& first = level.sightings[0];
  for (const Sighting& seen : level.as_span()) {
    sum_z += (seen.z - first.z).norm();
    sum_m += (seen.lamp_m - first.lamp_m).head<2>().norm();
  }
  const auto majority = find_largest_consistent_set(level.as_span(), limit_m * sum_z / sum_m);
  if (!majority) return std::nullopt;
  return find_agreeing_observations(make_body_state(majority->pose, problem, lean), frame, problem,
                                    limit_m);
}

/// Computes the fix of a majority of the lamps, and removes the others from the frame.
BodySolution estimate_body_from_majority(BodyObservations& frame, const Problem& problem,
                                         double max_residual_share) {
  const BodySolution none{FixStatus::inconsistent, {}};
  const double limit_m = compute_residual_limit(frame, max_residual_share);
  double latest_s = 0;
  for (const BodyObservation& seen : frame.as_span()) {
    latest_s = std::max(latest_s, std::abs(seen.time_s));
  }
  const double driven_m = 2 * problem.prior.velocity_sd_m_per_s * latest_s;
  auto agreeing = problem.is_roll_pitch_estimated()
                      ? find_majority_with_free_tilt(frame, problem, limit_m + driven_m)
                      : find_majority_if_level(frame, problem, limit_m + driven_m);
  // The majority ignored motion: with estimated motion, rejected lamps may agree.
  constexpr int max_iterations = 3;
  for (int iteration = 0; agreeing && iteration < max_iterations; ++iteration) {
    if (2 * agreeing->count() <= frame.size) return none;
    BodyObservations remaining = select_lamps(frame, *agreeing);
    if (remaining.num_current < 2) return none;
    const BodySolution solution = estimate_body_from_all_lamps(remaining, problem);
    if (solution.status != FixStatus::ok) return {solution.status, solution.fix};
    const Agreeing now_agreeing =
        find_agreeing_observations(solution.fix.state, frame, problem, limit_m);
    if (now_agreeing == *agreeing) {
      if (!is_within_prior(problem.prior, solution.fix.state.motion)) return none;
      frame = remaining;
      return solution;
    }
    agreeing = now_agreeing;
  }
  return none;
}

/// Rejects lamps one after another until the reported noise explains the residuals. Returns
/// std::nullopt if no lamp, or more than one, qualifies.
std::optional<BodySolution> reject_moved_lamps(BodyObservations& frame, const Problem& problem,
                                               const BodySolution& all) {
  BodyObservations remaining = frame;
  BodySolution solution = all;
  while (remaining.size > 3 && 2 * (remaining.size - 1) > frame.size) {
    std::optional<BodyFix> best;
    std::size_t moved = 0;
    double second = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < remaining.size; ++i) {
      Agreeing others;
      others.set().reset(i);
      const BodyObservations without = select_lamps(remaining, others);
      if (without.num_current < 2) continue;
      const auto fix =
          estimate_body_state(without.as_span(), problem.arm_m, problem.prior, solution.fix.state);
      if (!fix) continue;
      if (!best || fix->chi_squared < best->chi_squared) {
        if (best) second = best->chi_squared;
        best = fix, moved = i;
      } else {
        second = std::min(second, fix->chi_squared);
      }
    }
    if (!best) return std::nullopt;
    Agreeing others;
    others.set().reset(moved);
    remaining = select_lamps(remaining, others);
    solution.fix = *best;
    const double excess = compute_reduced_chi_squared(*best, remaining);
    if (excess < kUnexplained) {
      const double of_second = second / static_cast<double>(2 * remaining.size - 4);
      if (of_second < kUnexplained ||
          kMuchBetter * excess > compute_reduced_chi_squared(all.fix, frame) ||
          !is_within_prior(problem.prior, best->state.motion) || !is_determined(remaining, *best)) {
        return std::nullopt;
      }
      frame = remaining;
      return BodySolution{FixStatus::ok, *best};
    }
  }
  return std::nullopt;
}

}  // namespace

BodySolution estimate_body_state_robust(BodyObservations& frame,
                                        const Eigen::Vector3d& arm_in_body_m,
                                        const BodyPrior& prior, double max_residual_share) {
  const Problem problem{arm_in_body_m, prior};
  const double limit_m = compute_residual_limit(frame, max_residual_share);
  const BodySolution all = estimate_body_from_all_lamps(frame, problem);
  if (frame.size < 3) return all;
  if (is_consistent(all, frame, problem, limit_m)) {
    if (all.status != FixStatus::ok || compute_reduced_chi_squared(all.fix, frame) <= kUnexplained)
      return all;
    const BodySolution mirror_image =
        estimate_body_from_all_lamps(mirror_lamp_positions(frame), problem);
    if (mirror_image.status == FixStatus::ok &&
        kMuchBetter * compute_reduced_chi_squared(mirror_image.fix, frame) <
            compute_reduced_chi_squared(all.fix, frame)) {
      return {FixStatus::mirrored_map, {}};
    }
    // Constant velocity and yaw rate do not explain the frames.
    if (frame.num_current < frame.size) return {FixStatus::inconsistent, {}};
    if (!frame.noise_is_stated) return all;
    return reject_moved_lamps(frame, problem, all).value_or(all);
  }
  const BodyObservations mirror_frame = mirror_lamp_positions(frame);
  const BodySolution mirror_image = estimate_body_from_all_lamps(mirror_frame, problem);
  if (mirror_image.status == FixStatus::ok &&
      is_consistent(mirror_image, mirror_frame, problem, limit_m)) {
    return {FixStatus::mirrored_map, {}};
  }
  if (frame.size < 4) return has_fix(all) ? BodySolution{FixStatus::inconsistent, {}} : all;
  const BodySolution majority = estimate_body_from_majority(frame, problem, max_residual_share);
  if (majority.status == FixStatus::inconsistent && !has_fix(all)) return all;
  return majority;
}

}  // namespace vlp
