// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calibration/rotation/spot_captures.h"
#include "calibration/rotation/turning.h"

namespace vlp {

/// The fixes of the captures that have one, each with the frame it is of. A spot is what is at one
/// height: where the axis stands may change with the height.
struct SpotFixes {
  std::vector<std::size_t> frames;
  std::vector<TurningFix> fixes;
  std::size_t spots = 1;
};

/// Captures of a spot, and how far they turn.
struct SpotArc {
  std::size_t captures;
  double arc_rad;
};

inline constexpr std::size_t kLeastCaptures = 3;

/// Gives the captures of each height a spot of their own, from low to high. `noise_m` is the
/// standard deviation of a fix's height; see SpotCaptures.
void tell_heights_apart(SpotFixes& fixes, double noise_m);

std::vector<SpotArc> arcs_of(const SpotFixes& fixes);

/// Why none of the spots determines a centre; `ok` when one does.
SpotStatus status_of(const std::vector<SpotArc>& arcs);

/// Takes away spots of too few captures or too small an arc. `arcs` are those of `fixes`.
void drop_weak_spots(SpotFixes& fixes, const std::vector<SpotArc>& arcs);

/// The height in the middle of those of a spot.
double height_of(const SpotFixes& fixes, std::size_t spot);

}  // namespace vlp
