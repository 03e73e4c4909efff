// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <span>

#include "consensus.h"
#include "consistent_fix.h"
#include "sighting.h"

namespace vlp {

/// The lamps of one frame, in room of a fixed size so that nothing is allocated.
struct SightedFrame {
  std::array<Sighting, kMaxSightings> sightings;
  std::array<int, kMaxSightings> ids;
  /// Distance on the floor plan from each lamp to the nearest other lamp of the map.
  std::array<double, kMaxSightings> nearest_m;
  std::size_t size = 0;
  /// Whether every sigma_px is one that a detector stated.
  bool noise_is_stated = true;
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
ConsistentFix fix_frame(SightedFrame& frame, double max_residual_share);

}  // namespace vlp
