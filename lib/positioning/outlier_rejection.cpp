// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/outlier_rejection.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "positioning/closed_form.h"

namespace vlp {

namespace {

// The reported noise does not explain residuals above five standard deviations. If it explains a
// majority of the lamps a hundred times better, the others are wrong. A small error of the tilt or
// of the map affects all lamps and rarely has this pattern.
constexpr double kTooNoisySigmas = 5;
constexpr double kTooNoisy = kTooNoisySigmas * kTooNoisySigmas;
constexpr double kClearGain = 100;

/// Returns chi-squared over its expectation for the reported noise.
double compute_reduced_chi_squared(const LeastSquaresFix& fix, std::size_t lamps) {
  return fix.chi_squared / static_cast<double>(2 * lamps - 4);
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
double compute_residual_limit(const FrameObservations& frame, double max_residual_share) {
  constexpr double max_neighbor_fraction = 0.15;
  const double n = static_cast<double>(frame.size);
  const double spread = compute_rms_observation_radius(frame.as_span());
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (const Sighting& sighting : frame.as_span()) mean_m += sighting.lamp_m.head<2>() / n;
  double sum = 0, nearest_m = frame.nearest_m[0];
  for (std::size_t i = 0; i < frame.size; ++i) {
    sum += (frame.sightings[i].lamp_m.head<2>() - mean_m).squaredNorm();
    nearest_m = std::min(nearest_m, frame.nearest_m[i]);
  }
  const double spread_m = std::sqrt(sum / n);
  return std::min(max_residual_share * spread,
                  max_neighbor_fraction * nearest_m * spread / spread_m);
}

/// Computes the fix with the mirror image of the map.
ConsistentFix estimate_pose_of_mirrored_map(FrameObservations& frame, double limit) {
  mirror_observations(frame);
  const ConsistentFix solution = estimate_and_check_pose(frame.as_span(), limit);
  mirror_observations(frame);
  return solution;
}

/// Returns the fix of the majority if the reported noise explains only this one, else the fix of
/// all lamps.
ConsistentFix recheck_with_noise_threshold(FrameObservations& frame, const ConsistentFix& all,
                                           double max_residual_share) {
  const double excess = compute_reduced_chi_squared(all.fix, frame.size);
  const ConsistentFix mirrored =
      estimate_pose_of_mirrored_map(frame, compute_residual_limit(frame, max_residual_share));
  if (mirrored.status == FixStatus::ok &&
      kClearGain * compute_reduced_chi_squared(mirrored.fix, frame.size) < excess) {
    return {FixStatus::mirrored_map, {}};
  }
  if (!frame.noise_is_stated || frame.size < 4) return all;
  const auto majority = find_largest_consistent_set(
      frame.as_span(), kTooNoisySigmas * compute_max_point_sd(frame.as_span()));
  if (!majority) return all;
  FrameObservations agreeing = frame;
  agreeing.keep_only(majority->agreeing);
  const ConsistentFix solution = estimate_and_check_pose(
      agreeing.as_span(), compute_residual_limit(agreeing, max_residual_share));
  const double remaining = compute_reduced_chi_squared(solution.fix, agreeing.size);
  const bool explains =
      solution.status == FixStatus::ok && remaining < kTooNoisy && kClearGain * remaining < excess;
  if (!explains) return all;
  frame = agreeing;
  return solution;
}

}  // namespace

void FrameObservations::keep_only(const std::bitset<kMaxSightings>& kept) {
  std::size_t next = 0;
  for (std::size_t i = 0; i < size; ++i) {
    if (kept[i]) {
      sightings[next] = sightings[i];
      ids[next] = ids[i];
      nearest_m[next++] = nearest_m[i];
    } else {
      rejected_ids[static_cast<std::size_t>(rejected_lamps++)] = ids[i];
    }
  }
  size = next;
}

ConsistentFix estimate_pose_robust(FrameObservations& frame, double max_residual_share) {
  const double limit = compute_residual_limit(frame, max_residual_share);
  const ConsistentFix all = estimate_and_check_pose(frame.as_span(), limit);
  if (frame.size < 3) return all;
  if (all.status == FixStatus::ok) {
    return compute_reduced_chi_squared(all.fix, frame.size) > kTooNoisy
               ? recheck_with_noise_threshold(frame, all, max_residual_share)
               : all;
  }
  if (estimate_pose_of_mirrored_map(frame, limit).status == FixStatus::ok)
    return {FixStatus::mirrored_map, {}};
  if (frame.size < 4) return all;
  const auto majority = find_largest_consistent_set(frame.as_span(), limit);
  if (!majority) return all;
  frame.keep_only(majority->agreeing);
  return estimate_and_check_pose(frame.as_span(),
                                 compute_residual_limit(frame, max_residual_share));
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
    if (!(lamp_height_above_camera(camera, sightings[i].lamp_m) > 0)) continue;
    const double square =
        (sightings[i].z - project_to_normalized_point(camera, sightings[i].lamp_m)).squaredNorm();
    if (!(square <= max_residual * max_residual)) continue;
    result.consensus.agreeing.set(i);
    ++result.consensus.count;
    result.sum_of_squares += square;
  }
  return result;
}

}  // namespace

std::optional<Consensus> find_largest_consistent_set(std::span<const Sighting> sightings,
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
    return (sighting.z - project_to_normalized_point(camera, sighting.lamp_m)).norm() <=
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

double compute_rms_observation_radius(std::span<const Sighting> sightings) {
  const double n = static_cast<double>(sightings.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Sighting& sighting : sightings) mean += sighting.z / n;
  double sum = 0;
  for (const Sighting& sighting : sightings) sum += (sighting.z - mean).squaredNorm();
  return std::sqrt(sum / n);
}

}  // namespace vlp
