// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/consensus.h"

#include "positioning/two_lamp_fix.h"

namespace vlp {
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

}  // namespace vlp
