// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calibration/levelling/lamp_bundle.h"
#include "calibration/levelling/levelling.h"

namespace vlp {

std::size_t detections_in(const LampBundle& bundle);

/// Of each lamp, whether a capture sees it.
std::vector<bool> lamps_seen(const LampBundle& bundle);

/// Why the captures, from where they were taken, cannot determine the tilt (and the map), and what
/// to add; empty when they can. See level_by_lamps().
std::string undetermined_by(const LampBundle& bundle, const LampMap& map, bool refine_map);

/// The same when what was found is known too badly, beyond the options' limits.
std::string too_loose(const Levelling& result, const Matrix2& tilt_covariance,
                      const LevellingOptions& options);

inline constexpr const char* kTooWeak =
    "the captures do not determine it: the lamps they see are too few or in one line; add captures "
    "that see more lamps, at other places and yaws";

}  // namespace vlp
