// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/robust_fix.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "positioning/initial_pose.h"
#include "positioning/two_lamp_fix.h"

namespace vlp {

namespace {

// The reported noise does not explain residuals above five standard deviations. If it explains a
// majority of the lamps a hundred times better, the others are wrong. A small error of the tilt or
// of the map affects all lamps and rarely has this pattern.
constexpr double kTooNoisySigmas = 5;
constexpr double kTooNoisy = kTooNoisySigmas * kTooNoisySigmas;
constexpr double kClearGain = 100;

/// Returns chi-squared over its expectation for the reported noise.
double excess_of(const LeastSquaresFix& fix, std::size_t lamps) {
  return fix.chi_squared / static_cast<double>(2 * lamps - 4);
}

/// Returns the largest standard deviation of z.
double noise_of(std::span<const Sighting> sightings) {
  double noise = 0;
  for (const Sighting& sighting : sightings) {
    noise = std::max(noise,
                     sighting.sigma_px / std::sqrt(std::abs(sighting.d_pixel_d_z.determinant())));
  }
  return noise;
}

/// Mirrors the observations, as by a camera under the mirrored map.
void mirror(SightedFrame& frame) {
  for (Sighting& sighting : std::span(frame.sightings.data(), frame.size)) {
    sighting.z.y() = -sighting.z.y();
    sighting.d_pixel_d_z.col(1) = -sighting.d_pixel_d_z.col(1);
  }
}

/// Returns the residual limit in z. The RMS radii of the lamps in z and on the floor plan give the
/// scale, since the fix may be wrong.
double limit_of(const SightedFrame& frame, double max_residual_share) {
  constexpr double share_of_the_way = 0.15;
  const double n = static_cast<double>(frame.size);
  const double spread = spread_of(frame.span());
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (const Sighting& sighting : frame.span()) mean_m += sighting.lamp_m.head<2>() / n;
  double sum = 0, nearest_m = frame.nearest_m[0];
  for (std::size_t i = 0; i < frame.size; ++i) {
    sum += (frame.sightings[i].lamp_m.head<2>() - mean_m).squaredNorm();
    nearest_m = std::min(nearest_m, frame.nearest_m[i]);
  }
  const double spread_m = std::sqrt(sum / n);
  return std::min(max_residual_share * spread, share_of_the_way * nearest_m * spread / spread_m);
}

/// Computes the fix with the mirror image of the map.
ConsistentFix fix_mirrored(SightedFrame& frame, double limit) {
  mirror(frame);
  const ConsistentFix solution = fix_consistent(frame.span(), limit);
  mirror(frame);
  return solution;
}

/// Returns the fix of the majority if the reported noise explains only this one, else the fix of
/// all lamps.
ConsistentFix fix_doubtful(SightedFrame& frame, const ConsistentFix& all,
                           double max_residual_share) {
  const double excess = excess_of(all.fix, frame.size);
  const ConsistentFix mirrored = fix_mirrored(frame, limit_of(frame, max_residual_share));
  if (mirrored.status == FixStatus::ok &&
      kClearGain * excess_of(mirrored.fix, frame.size) < excess) {
    return {FixStatus::mirrored_map, {}};
  }
  if (!frame.noise_is_stated || frame.size < 4) return all;
  const auto majority = find_consensus(frame.span(), kTooNoisySigmas * noise_of(frame.span()));
  if (!majority) return all;
  SightedFrame agreeing = frame;
  agreeing.keep(majority->agreeing);
  const ConsistentFix solution =
      fix_consistent(agreeing.span(), limit_of(agreeing, max_residual_share));
  const double remaining = excess_of(solution.fix, agreeing.size);
  const bool explains =
      solution.status == FixStatus::ok && remaining < kTooNoisy && kClearGain * remaining < excess;
  if (!explains) return all;
  frame = agreeing;
  return solution;
}

}  // namespace

void SightedFrame::keep(const std::bitset<kMaxSightings>& kept) {
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

ConsistentFix fix_robustly(SightedFrame& frame, double max_residual_share) {
  const double limit = limit_of(frame, max_residual_share);
  const ConsistentFix all = fix_consistent(frame.span(), limit);
  if (frame.size < 3) return all;
  if (all.status == FixStatus::ok) {
    return excess_of(all.fix, frame.size) > kTooNoisy ? fix_doubtful(frame, all, max_residual_share)
                                                      : all;
  }
  if (fix_mirrored(frame, limit).status == FixStatus::ok) return {FixStatus::mirrored_map, {}};
  if (frame.size < 4) return all;
  const auto majority = find_consensus(frame.span(), limit);
  if (!majority) return all;
  frame.keep(majority->agreeing);
  return fix_consistent(frame.span(), limit_of(frame, max_residual_share));
}

namespace {

struct Vote {
  Consensus consensus;
  double sum_of_squares;
};

Vote vote(std::span<const Sighting> sightings, const Pose& pose, double max_residual) {
  const LevelPose camera(pose);
  Vote result{{pose, {}, 0}, 0};
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!(height_above(camera, sightings[i].lamp_m) > 0)) continue;
    const double square = (sightings[i].z - predicted_z(camera, sightings[i].lamp_m)).squaredNorm();
    if (!(square <= max_residual * max_residual)) continue;
    result.consensus.agreeing.set(i);
    ++result.consensus.count;
    result.sum_of_squares += square;
  }
  return result;
}

}  // namespace

std::optional<Consensus> find_consensus(std::span<const Sighting> sightings, double max_residual) {
  const std::size_t n = sightings.size();
  const std::size_t stride = 1 + n / 65;
  Vote best{{{}, {}, 0}, 0};
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; j += stride) {
      const TwoLampFix pair = fix_two_lamps(sightings[i], sightings[j]);
      for (int k = 0; k < pair.count; ++k) {
        const Vote next = vote(sightings, pair.poses[static_cast<std::size_t>(k)], max_residual);
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

bool agree(std::span<const Sighting> sightings, const Pose& pose, double max_residual) {
  const LevelPose camera(pose);
  return std::all_of(sightings.begin(), sightings.end(), [&](const Sighting& sighting) {
    return (sighting.z - predicted_z(camera, sighting.lamp_m)).norm() <= max_residual;
  });
}

}  // namespace

ConsistentFix fix_consistent(std::span<const Sighting> sightings, double max_residual) {
  const InitialPose start = initial_pose(sightings);
  if (start.status != FixStatus::ok) return {start.status, {}};
  const auto fix = fix_least_squares(sightings, start.pose);
  if (!fix) return {FixStatus::degenerate, {}};
  const double height_m = sightings.front().lamp_m.z() - fix->pose.position_m.z();
  if (!(fix->covariance(2, 2) < height_m * height_m)) return {FixStatus::degenerate, *fix};
  if (sightings.size() > 2 && !agree(sightings, fix->pose, max_residual)) {
    return {FixStatus::inconsistent, *fix};
  }
  return {FixStatus::ok, *fix};
}

double spread_of(std::span<const Sighting> sightings) {
  const double n = static_cast<double>(sightings.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Sighting& sighting : sightings) mean += sighting.z / n;
  double sum = 0;
  for (const Sighting& sighting : sightings) sum += (sighting.z - mean).squaredNorm();
  return std::sqrt(sum / n);
}

}  // namespace vlp
