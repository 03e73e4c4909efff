// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <span>

#include "pose_estimation.h"
#include "sighting.h"

namespace vlp {

/// Maximum number of observations in a frame.
inline constexpr std::size_t kMaxSightings = 256;

/// Lamps observed in one frame or in several. The arrays have a fixed size, so that no memory is
/// allocated.
template <typename Observation>
struct LampObservations {
  std::array<Observation, kMaxSightings> sightings;
  std::array<int, kMaxSightings> ids;
  /// Horizontal distance from each lamp to the nearest other lamp of the map, m.
  std::array<double, kMaxSightings> nearest_m;
  std::size_t size = 0;
  /// True if every detection has a sigma_px.
  bool noise_is_stated = true;
  int unknown_lamps = 0;
  int rejected_lamps = 0;
  std::array<int, kMaxSightings> rejected_ids = {};

  std::span<const Observation> observations_span() const { return {sightings.data(), size}; }

  /// Removes all observations except those in `kept`. The removed ones among the first
  /// `num_reported` count as rejected.
  void keep_only_selected_observations(const std::bitset<kMaxSightings>& kept,
                                       std::size_t num_reported = kMaxSightings) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < size; ++i) {
      if (kept[i]) {
        sightings[next] = sightings[i];
        ids[next] = ids[i];
        nearest_m[next++] = nearest_m[i];
      } else if (i < num_reported) {
        rejected_ids[static_cast<std::size_t>(rejected_lamps++)] = ids[i];
      }
    }
    size = next;
  }
};

/// Lamps observed in one frame by a level camera.
struct FrameObservations : LampObservations<Sighting> {
  /// False if observations are weighted in the undistorted image, where the noise differs.
  bool is_weighed_by_noise = true;
};

/// Lamps observed in one frame, or in several consecutive frames.
struct BodyObservations : LampObservations<BodyObservation> {
  /// Number of observations from the frame of the fix; they are at the start of the arrays. All
  /// other observations are from earlier frames.
  std::size_t num_current = 0;

  /// Removes all observations except those in `kept`. The removed ones of the current frame count
  /// as rejected.
  void keep_only_selected_observations(const std::bitset<kMaxSightings>& kept) {
    std::size_t kept_current = 0;
    for (std::size_t i = 0; i < num_current; ++i) kept_current += kept[i];
    LampObservations::keep_only_selected_observations(kept, num_current);
    num_current = kept_current;
  }
};

}  // namespace vlp
