// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"
#include "least_squares_fix.h"
#include "sighting.h"

namespace vlp {

/// The most sightings that one frame may have.
inline constexpr std::size_t kMaxSightings = 256;

/// Which sightings agree with a pose.
struct Consensus {
  Pose pose;
  std::bitset<kMaxSightings> agreeing;
  std::size_t count;
};

/// The largest set of sightings that one pose explains, each within `max_residual` of the
/// sighting's z: every pair of lamps proposes its poses, the one with the most agreeing lamps wins,
/// and of several the one with the least squared residuals. Nothing without a majority of three or
/// more. Of more than 64 lamps the pairs are a fixed selection. Precondition: at most
/// kMaxSightings.
std::optional<Consensus> find_consensus(std::span<const Sighting> sightings, double max_residual);

struct ConsistentFix {
  /// `ok`, or why there is none.
  FixStatus status;
  LeastSquaresFix fix;
};

/// The least-squares fix of two or more lamps from initial_pose(), looked at critically:
///   degenerate    the lamps do not determine it: the standard deviation of the height exceeds the
///                 height;
///   inconsistent  of three or more, one is farther in z than `max_residual` from where the fix
///                 sees it.
ConsistentFix fix_consistent(std::span<const Sighting> sightings, double max_residual);

/// Root of the mean squared distance of the sightings from their mean, in z.
double spread_of(std::span<const Sighting> sightings);

/// The lamps of one frame, in room of a fixed size so that nothing is allocated.
struct SightedFrame {
  std::array<Sighting, kMaxSightings> sightings;
  std::array<int, kMaxSightings> ids;
  /// Distance on the floor plan from each lamp to the nearest other lamp of the map.
  std::array<double, kMaxSightings> nearest_m;
  std::size_t size = 0;
  /// Whether every sigma_px is one that a detector stated.
  bool noise_is_stated = true;
  /// False if sightings are weighed in the undistorted image, which has other noise.
  bool is_weighed_by_noise = true;
  int unknown_lamps = 0;
  int rejected_lamps = 0;
  std::array<int, kMaxSightings> rejected_ids;

  std::span<const Sighting> span() const { return {sightings.data(), size}; }
  /// Leaves only the sightings that are `kept`; the others count as rejected.
  void keep(const std::bitset<kMaxSightings>& kept);
};

/// The fix of a frame of two lamps or more whose identities may be wrong. A lamp contradicts the
/// fix when it is farther from where the fix sees it than `max_residual_share` of the spread of
/// all lamps in the image, or than 0.15 of the way to the lamp nearest to one of them, which it
/// might be. Then, of
///   three or more  that fit the mirror image of the map, the status is `mirrored_map`;
///   four or more   the majority that agrees makes the fix (find_consensus), and the others are
///                  taken out of the frame and counted as rejected;
///   others         the status is `inconsistent`.
/// Lamps that do not contradict the fix by so much are looked at again when their noise does not
/// explain their residuals: if the mirror image is a hundred times better, it is `mirrored_map`;
/// where all noise is stated and it explains the residuals of a majority, and a hundred times
/// better, the others are rejected.
ConsistentFix fix_robustly(SightedFrame& frame, double max_residual_share);

}  // namespace vlp
