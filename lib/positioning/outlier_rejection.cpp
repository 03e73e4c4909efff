// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/outlier_rejection.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "geometry/angles.h"
#include "geometry/statistical_bounds.h"
#include "geometry/symmetric.h"
#include "positioning/closed_form.h"

namespace vlp {

namespace {

/// Ratio of the reduced chi-squared of all lamps to that of a majority above which the others are
/// wrong, if the reported noise does not explain the residuals of all (kMaxReducedChiSquared). A
/// small error of the tilt or of the map affects all lamps and rarely has this pattern.
constexpr double kClearGain = 100;

/// Maximum distance of a lamp from its prediction, as a fraction of the distance of neighbors.
constexpr double kMaxNeighborFraction = 0.15;

/// Returns the RMS distance of the points of the observations from their mean.
template <typename Observation, typename Point>
double compute_rms_radius(std::span<const Observation> observations, const Point& point_of) {
  using Vector = std::decay_t<decltype(point_of(observations.front()))>;
  const double n = static_cast<double>(observations.size());
  Vector mean = Vector::Zero();
  for (const Observation& observation : observations) mean += point_of(observation) / n;
  double sum = 0;
  for (const Observation& observation : observations) {
    sum += (point_of(observation) - mean).squaredNorm();
  }
  return std::sqrt(sum / n);
}

/// Returns the smallest distance from a lamp of the frame to its nearest lamp of the map.
template <typename Observation>
double find_nearest_lamp_distance_m(const LampObservations<Observation>& frame) {
  return *std::min_element(frame.nearest_m.begin(),
                           frame.nearest_m.begin() + static_cast<std::ptrdiff_t>(frame.size));
}

/// Returns the largest standard deviation of z.
double compute_max_point_sd(std::span<const Sighting> sightings) {
  double noise = 0;
  for (const Sighting& sighting : sightings) {
    noise = std::max(noise,
                     sighting.sigma_px / std::sqrt(std::abs(sighting.d_pixel_d_z.determinant())));
  }
  return noise;
}

/// Mirrors the observations, as by a camera under the mirrored map.
void mirror_observations(FrameObservations& frame) {
  for (Sighting& sighting : std::span(frame.sightings.data(), frame.size)) {
    sighting.z.y() = -sighting.z.y();
    sighting.d_pixel_d_z.col(1) = -sighting.d_pixel_d_z.col(1);
  }
}

/// Returns the residual limit in z. The RMS radii of the lamps in z and on the floor plan give the
/// scale, since the fix may be wrong.
double compute_residual_limit(const FrameObservations& frame, double max_residual_fraction) {
  const double spread = compute_rms_radius(frame.observations_span(),
                                           [](const Sighting& sighting) { return sighting.z; });
  const double spread_m = compute_rms_radius(
      frame.observations_span(),
      [](const Sighting& sighting) { return Eigen::Vector2d(sighting.lamp_m.head<2>()); });
  return std::min(max_residual_fraction * spread,
                  kMaxNeighborFraction * find_nearest_lamp_distance_m(frame) * spread / spread_m);
}

/// Computes the fix with the mirror image of the map.
ConsistentFix estimate_pose_of_mirrored_map(FrameObservations& frame, double limit) {
  mirror_observations(frame);
  const ConsistentFix solution = estimate_and_check_pose(frame.observations_span(), limit);
  mirror_observations(frame);
  return solution;
}

/// Returns the fix of the majority if the reported noise explains only this one, else the fix of
/// all lamps.
ConsistentFix recheck_with_noise_threshold(FrameObservations& frame, const ConsistentFix& all,
                                           double max_residual_fraction) {
  const double excess = compute_reduced_chi_squared(all.fix.chi_squared, frame.size);
  const ConsistentFix mirrored =
      estimate_pose_of_mirrored_map(frame, compute_residual_limit(frame, max_residual_fraction));
  if (mirrored.status == FixStatus::ok &&
      kClearGain * compute_reduced_chi_squared(mirrored.fix.chi_squared, frame.size) < excess) {
    return {FixStatus::mirrored_map, {}};
  }
  if (!frame.noise_is_stated || frame.size < 4) return all;
  const auto majority = find_largest_consistent_lamp_set(
      frame.observations_span(),
      std::sqrt(kMaxReducedChiSquared) * compute_max_point_sd(frame.observations_span()));
  if (!majority) return all;
  FrameObservations agreeing = frame;
  agreeing.keep_only_selected_observations(majority->inliers);
  const ConsistentFix solution = estimate_and_check_pose(
      agreeing.observations_span(), compute_residual_limit(agreeing, max_residual_fraction));
  const double remaining = compute_reduced_chi_squared(solution.fix.chi_squared, agreeing.size);
  const bool explains = solution.status == FixStatus::ok && remaining < kMaxReducedChiSquared &&
                        kClearGain * remaining < excess;
  if (!explains) return all;
  frame = agreeing;
  return solution;
}

}  // namespace

ConsistentFix estimate_pose_robust(FrameObservations& frame, double max_residual_fraction) {
  const double limit = compute_residual_limit(frame, max_residual_fraction);
  const ConsistentFix all = estimate_and_check_pose(frame.observations_span(), limit);
  if (frame.size < 3) return all;
  if (all.status == FixStatus::ok) {
    return compute_reduced_chi_squared(all.fix.chi_squared, frame.size) > kMaxReducedChiSquared
               ? recheck_with_noise_threshold(frame, all, max_residual_fraction)
               : all;
  }
  if (estimate_pose_of_mirrored_map(frame, limit).status == FixStatus::ok)
    return {FixStatus::mirrored_map, {}};
  if (frame.size < 4) return all;
  const auto majority = find_largest_consistent_lamp_set(frame.observations_span(), limit);
  if (!majority) return all;
  frame.keep_only_selected_observations(majority->inliers);
  return estimate_and_check_pose(frame.observations_span(),
                                 compute_residual_limit(frame, max_residual_fraction));
}

namespace {

struct Vote {
  Consensus consensus;
  double sum_of_squares;
};

Vote find_pose_with_most_votes(std::span<const Sighting> sightings, const Pose& pose,
                               double max_residual) {
  const LevelPose camera(pose);
  Vote result{{pose, {}, 0}, 0};
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!(lamp_height_above_camera_m(camera, sightings[i].lamp_m) > 0)) continue;
    const double square =
        (sightings[i].z - project_lamp_to_normalized_point(camera, sightings[i].lamp_m))
            .squaredNorm();
    if (!(square <= max_residual * max_residual)) continue;
    result.consensus.inliers.set(i);
    ++result.consensus.count;
    result.sum_of_squares += square;
  }
  return result;
}

}  // namespace

std::optional<Consensus> find_largest_consistent_lamp_set(std::span<const Sighting> sightings,
                                                          double max_residual) {
  const std::size_t n = sightings.size();
  const std::size_t stride = 1 + n / 65;
  Vote best{{{}, {}, 0}, 0};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; j += stride) {
      const TwoLampPoses pair = compute_two_lamp_poses(sightings[i], sightings[j]);
      for (int k = 0; k < pair.count; ++k) {
        const Vote next = find_pose_with_most_votes(
            sightings, pair.poses[static_cast<std::size_t>(k)], max_residual);
        const bool wins = next.consensus.count > best.consensus.count ||
                          (next.consensus.count == best.consensus.count &&
                           next.sum_of_squares < best.sum_of_squares);
        if (wins) best = next;
      }
    }
  }
  if (best.consensus.count < 3 || 2 * best.consensus.count <= n) return std::nullopt;
  return best.consensus;
}

namespace {

bool are_consistent_with_pose(std::span<const Sighting> sightings, const Pose& pose,
                              double max_residual) {
  const LevelPose camera(pose);
  return std::all_of(sightings.begin(), sightings.end(), [&](const Sighting& sighting) {
    return (sighting.z - project_lamp_to_normalized_point(camera, sighting.lamp_m)).norm() <=
           max_residual;
  });
}

}  // namespace

ConsistentFix estimate_and_check_pose(std::span<const Sighting> sightings, double max_residual) {
  const InitialPose start = compute_initial_pose(sightings);
  if (start.status != FixStatus::ok) return {start.status, {}};
  const auto fix = estimate_pose_least_squares(sightings, start.pose);
  if (!fix) return {FixStatus::degenerate, {}};
  const double height_m = sightings.front().lamp_m.z() - fix->pose.position_m.z();
  if (!(fix->covariance(2, 2) < height_m * height_m)) return {FixStatus::degenerate, *fix};
  if (sightings.size() > 2 && !are_consistent_with_pose(sightings, fix->pose, max_residual)) {
    return {FixStatus::inconsistent, *fix};
  }
  return {FixStatus::ok, *fix};
}

namespace {

using Agreeing = std::bitset<kMaxSightings>;

/// Returns the distance of a lamp from its observed ray; infinity if the lamp is behind it.
double distance_from_ray(const BodyObservation& seen, const BodyProblem& problem,
                         const EvaluatedState& body) {
  const Eigen::Vector3d q = body.lamp_position_in_body(seen.lamp_m, seen.time_s) - problem.arm_m;
  const double depth_m = seen.ray.dot(q);
  return depth_m > 0 ? (q - depth_m * seen.ray).norm() : std::numeric_limits<double>::infinity();
}

/// Returns the largest accepted distance of a lamp from its ray, in m.
double compute_residual_limit(const BodyObservations& frame, double max_residual_fraction) {
  const double spread_m = compute_rms_radius(
      frame.observations_span(), [](const BodyObservation& seen) { return seen.lamp_m; });
  return std::min(max_residual_fraction * spread_m,
                  kMaxNeighborFraction * find_nearest_lamp_distance_m(frame));
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
                                    const BodyProblem& problem, double limit_m) {
  Agreeing agreeing;
  const EvaluatedState body(state);
  for (std::size_t i = 0; i < frame.size; ++i) {
    agreeing[i] = distance_from_ray(frame.sightings[i], problem, body) <= limit_m;
  }
  return agreeing;
}

bool is_consistent(const BodySolution& solution, const BodyObservations& frame,
                   const BodyProblem& problem, double limit_m) {
  return has_fix(solution) && is_within_prior(problem.prior, solution.fix.state.motion) &&
         find_agreeing_observations(solution.fix.state, frame, problem, limit_m).count() ==
             frame.size;
}

BodyObservations select_lamps(const BodyObservations& frame, const Agreeing& agreeing) {
  BodyObservations remaining = frame;
  remaining.keep_only_selected_observations(agreeing);
  return remaining;
}

/// Returns the frame with the mirror image of the map.
BodyObservations mirror_lamp_positions(BodyObservations frame) {
  for (std::size_t i = 0; i < frame.size; ++i) frame.sightings[i].lamp_m.y() *= -1;
  return frame;
}

/// Finds the largest set of lamps that agree with a state of free roll and pitch, at rest. Every
/// triple of lamps proposes its states. Returns std::nullopt if fewer than four lamps agree.
std::optional<Agreeing> find_majority_with_free_tilt(const BodyObservations& frame,
                                                     const BodyProblem& problem, double limit_m) {
  constexpr std::size_t few = 12, at_least = 4;
  const std::size_t n = frame.num_current, stride = n <= few ? 1 : n * n * n / (few * few * few);
  Agreeing best;
  std::size_t turn = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (turn++ % stride != 0) continue;
        const InitialStates initial_states =
            compute_initial_body_states_from_three_lamps(frame, {i, j, k}, problem);
        for (std::size_t m = 0; static_cast<int>(m) < initial_states.count; ++m) {
          const Agreeing agreeing =
              find_agreeing_observations(initial_states.states[m], frame, problem, limit_m);
          if (agreeing.count() > best.count()) best = agreeing;
        }
      }
    }
  }
  if (best.count() < at_least) return std::nullopt;
  return best;
}

/// Finds the largest set of lamps that agree with a state with the inclination of the prior.
std::optional<Agreeing> find_majority_if_level(const BodyObservations& frame,
                                               const BodyProblem& problem, double limit_m) {
  const Eigen::Matrix3d lean = level_rotation_from_inclination(problem.prior.mean.inclination);
  LevelSightings level;
  if (!level.set_sightings_in_level_frame(frame, lean)) return std::nullopt;
  // The limit is converted to z by the ratio of the distances between lamps.
  double sum_z = 0, sum_m = 0;
  const Sighting& first = level.sightings[0];
  for (const Sighting& seen : level.observations_span()) {
    sum_z += (seen.z - first.z).norm();
    sum_m += (seen.lamp_m - first.lamp_m).head<2>().norm();
  }
  const auto majority =
      find_largest_consistent_lamp_set(level.observations_span(), limit_m * sum_z / sum_m);
  if (!majority) return std::nullopt;
  return find_agreeing_observations(make_body_state_from_camera_pose(majority->pose, problem, lean),
                                    frame, problem, limit_m);
}

/// Computes the fix of a majority of the lamps, and removes the others from the frame.
BodySolution estimate_body_from_majority(BodyObservations& frame, const BodyProblem& problem,
                                         double max_residual_fraction) {
  const BodySolution none{FixStatus::inconsistent, {}};
  const double limit_m = compute_residual_limit(frame, max_residual_fraction);
  double latest_s = 0;
  for (const BodyObservation& seen : frame.observations_span()) {
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
    const BodySolution solution = estimate_body_state_from_all_lamps(remaining, problem);
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
/// @pre all observations are from the current frame
std::optional<BodySolution> reject_moved_lamps(BodyObservations& frame, const BodyProblem& problem,
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
      const auto fix = estimate_body_state(without.observations_span(), problem.arm_m,
                                           problem.prior, solution.fix.state);
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
    const double excess = compute_reduced_chi_squared(best->chi_squared, remaining.size);
    if (excess < kMaxReducedChiSquared) {
      const double of_second = compute_reduced_chi_squared(second, remaining.size);
      if (of_second < kMaxReducedChiSquared ||
          kClearGain * excess > compute_reduced_chi_squared(all.fix.chi_squared, frame.size) ||
          !is_within_prior(problem.prior, best->state.motion) ||
          !is_body_position_determined(remaining, *best)) {
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
                                        const BodyPrior& prior, double max_residual_fraction) {
  const BodyProblem problem{arm_in_body_m, prior};
  const double limit_m = compute_residual_limit(frame, max_residual_fraction);
  const BodySolution all = estimate_body_state_from_all_lamps(frame, problem);
  if (frame.size < 3) return all;
  if (is_consistent(all, frame, problem, limit_m)) {
    if (all.status != FixStatus::ok ||
        compute_reduced_chi_squared(all.fix.chi_squared, frame.size) <= kMaxReducedChiSquared)
      return all;
    const BodySolution mirror_image =
        estimate_body_state_from_all_lamps(mirror_lamp_positions(frame), problem);
    if (mirror_image.status == FixStatus::ok &&
        kClearGain * compute_reduced_chi_squared(mirror_image.fix.chi_squared, frame.size) <
            compute_reduced_chi_squared(all.fix.chi_squared, frame.size)) {
      return {FixStatus::mirrored_map, {}};
    }
    // Constant velocity and yaw rate do not explain the frames.
    if (frame.num_current < frame.size) return {FixStatus::inconsistent, {}};
    if (!frame.noise_is_stated) return all;
    return reject_moved_lamps(frame, problem, all).value_or(all);
  }
  const BodyObservations mirror_frame = mirror_lamp_positions(frame);
  const BodySolution mirror_image = estimate_body_state_from_all_lamps(mirror_frame, problem);
  if (mirror_image.status == FixStatus::ok &&
      is_consistent(mirror_image, mirror_frame, problem, limit_m)) {
    return {FixStatus::mirrored_map, {}};
  }
  if (frame.size < 4) return has_fix(all) ? BodySolution{FixStatus::inconsistent, {}} : all;
  const BodySolution majority = estimate_body_from_majority(frame, problem, max_residual_fraction);
  if (majority.status == FixStatus::inconsistent && !has_fix(all)) return all;
  return majority;
}

OutlierLamps find_outlier_lamps(std::span<const Sighting> sightings,
                                std::span<const Matrix2> common, const LeastSquaresFix& fix) {
  OutlierLamps found;
  if (sightings.size() < 4) return found;
  const LevelPose pose(fix.pose);
  std::bitset<kMaxSightings> rejected;
  for (std::size_t left = sightings.size(); left >= 3; --left) {
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
    const auto each = [&](auto&& use) {
      for (std::size_t i = 0; i < sightings.size(); ++i) {
        if (rejected[i]) continue;
        const Sighting& one = sightings[i];
        const Eigen::Matrix2d by_pixel = one.d_pixel_d_z.inverse() * one.sigma_px;
        const Eigen::Matrix2d covariance = by_pixel * by_pixel.transpose() + common[i];
        const Prediction prediction = project_lamp_with_jacobian(pose, one.lamp_m);
        use(i, covariance, prediction.d_z_d_state, Eigen::Vector2d(one.z - prediction.z));
      }
    };
    each([&](std::size_t, const Eigen::Matrix2d& covariance, const auto& jacobian,
             const Eigen::Vector2d& residual) {
      const Eigen::Matrix<double, 4, 2> weighted = jacobian.transpose() * covariance.inverse();
      information += weighted * jacobian;
      gradient += weighted * residual;
    });
    const auto state_covariance = invert_positive_definite_matrix(information);
    if (!state_covariance) return {};
    const Eigen::Vector4d step = *state_covariance * gradient;
    double chi_squared = 0, worst = 0;
    std::size_t worst_lamp = 0;
    each([&](std::size_t i, const Eigen::Matrix2d& covariance, const auto& jacobian,
             const Eigen::Vector2d& residual) {
      const Eigen::Vector2d r = residual - jacobian * step;
      chi_squared += r.dot(covariance.inverse() * r);
      const Eigen::Matrix2d of_residual =
          covariance - jacobian * *state_covariance * jacobian.transpose();
      const double drop = r.dot(of_residual.inverse() * r);
      if (!(of_residual.determinant() > 0) || drop <= worst) return;
      worst = drop;
      worst_lamp = i;
    });
    const double freedom = 2 * static_cast<double>(left) - 4;
    if (chi_squared <= compute_chi_squared_bound(kSigmasOfOneInTenThousand, freedom)) return found;
    // Three contradicting lamps do not determine which is wrong; nor does a minority.
    if (!(worst > 0) || left == 3 || 2 * (left - 1) <= sightings.size()) return {};
    rejected.set(worst_lamp);
    found.lamps[found.count++] = worst_lamp;
  }
  return {};
}

}  // namespace vlp
