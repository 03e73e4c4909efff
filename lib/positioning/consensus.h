// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <cstddef>
#include <optional>
#include <span>

#include "../geometry/frames.h"
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

}  // namespace vlp
