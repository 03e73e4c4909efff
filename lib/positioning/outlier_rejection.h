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

/// Maximum number of observations in a frame.
inline constexpr std::size_t kMaxSightings = 256;

/// Result of find_largest_consistent_set(): a pose and the observations that agree with it.
/// `agreeing` has a bit per observation, by its index; `count` is the number of set bits.
struct Consensus {
  Pose pose;
  std::bitset<kMaxSightings> agreeing;
  std::size_t count;
};

/// Finds the largest set of observations that one pose explains, each with a residual of z of at
/// most `max_residual`. Every pair of lamps proposes its poses. The pose with the most agreeing
/// lamps wins; among equals, the one with the smallest sum of squared residuals. With more than 64
/// lamps the pairs are a fixed selection. Returns std::nullopt without a majority of at least
/// three.
/// @pre at most kMaxSightings observations
std::optional<Consensus> find_largest_consistent_set(std::span<const Sighting> sightings,
                                                     double max_residual);

/// Least-squares fix of a frame, valid if the status is `ok`.
struct ConsistentFix {
  /// `ok`, or the reason of failure.
  FixStatus status;
  LeastSquaresFix fix;
};

/// Computes the least-squares fix of two lamps or more from compute_initial_pose() and checks it:
///   degenerate    the lamps do not determine it: the standard deviation of the height exceeds the
///                 height
///   inconsistent  of three lamps or more, one has a residual of z above `max_residual`
ConsistentFix estimate_and_check_pose(std::span<const Sighting> sightings, double max_residual);

/// Computes the RMS distance of the normalized points z of the observations from their mean;
/// dimensionless.
double compute_rms_observation_radius(std::span<const Sighting> sightings);

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

  std::span<const Observation> as_span() const { return {sightings.data(), size}; }
};

/// Lamps observed in one frame by a level camera.
struct FrameObservations : LampObservations<Sighting> {
  /// False if observations are weighted in the undistorted image, where the noise differs.
  bool is_weighed_by_noise = true;

  /// Removes all observations except those whose bit is set in `kept`, by their index. The removed
  /// ones count as rejected.
  void keep_only(const std::bitset<kMaxSightings>& kept);
};

/// Computes the fix of a frame with two lamps or more whose identities may be wrong.
///
/// A lamp contradicts the fix if its residual exceeds one of two limits:
///   `max_residual_share` times the RMS radius of all lamps in the image;
///   0.15 times the smallest distance from a lamp of the frame to its nearest lamp of the map,
///   which excludes confusion of neighbors.
/// On a contradiction, with
///   three or more  that fit the mirror image of the map, the status is `mirrored_map`;
///   four or more   the agreeing majority makes the fix (find_largest_consistent_set()); the others
///                  are rejected;
///   others         the status is `inconsistent`.
///
/// Lamps below these limits are tested again if their residuals exceed five standard deviations. If
/// the mirror image fits a hundred times better, the status is `mirrored_map`. If all noise is
/// reported, and explains the residuals of a majority a hundred times better, the other lamps are
/// rejected.
ConsistentFix estimate_pose_robust(FrameObservations& frame, double max_residual_share);

}  // namespace vlp
