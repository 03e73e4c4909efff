// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "lamps/signal/stripes.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Maximum relative deviation of a lamp's frequency from the map at which no confusion with another
/// lamp is possible.
inline constexpr double kLampDrift = 0.015;

/// Maximum relative deviation of a light's measured frequency from that of its lamp, as a fraction,
/// if its stripes are few or unclear. Lights with clear stripes (are_stripes_reliable()) may
/// deviate by 0.06.
inline constexpr double kMaxUnclearDrift = 0.025;

/// Minimum difference between the duty errors of two lamps for a decision between them. Saturation
/// and blur change the measured duty by up to about half of it.
inline constexpr double kDutyMargin = 0.15;

/// Identifies the lamp of the map with these stripes. A lamp of frequency f has a period of 1 / (f
/// row_time) scanlines. The deviation of every other lamp's frequency has to be larger by
/// kLampDrift and twice as large. Lamps with nearly the same frequency are separated by the duties
/// of the map. Returns std::nullopt if the stripes agree with no lamp or with several lamps.
std::optional<int> identify_by_frequency(const LampMap& lamps, double row_time_s,
                                         const Stripes& stripes);

}  // namespace vlp
