// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "lamps/signal/stripes.h"
#include "rig/lamp_map.h"

namespace vlp {

/// How far a lamp may be from the frequency that the map states, as a share of it, before
/// it may be taken for another.
inline constexpr double kLampDrift = 0.015;

/// How far a light may be from a lamp's frequency, as a share of it, when its stripes are few or
/// unclear; those that are not may be farther.
inline constexpr double kMostOffUnclear = 0.025;

/// How much nearer in duty a light has to be to one lamp than to another: saturation and blur
/// change the duty that is seen by up to about half of it.
inline constexpr double kDutyMargin = 0.15;

/// The lamp of the map whose stripes these are, without any training: a lamp of frequency f has
/// a period of 1 / (f row_time) lines. Its frequency has to be nearer than any other lamp's, by
/// kLampDrift and by as much again as it is off itself; of lamps with nearly one frequency
/// the duties of the map decide. Nothing when the stripes are like no lamp's, or like two lamps'.
std::optional<int> lamp_by_frequency(const LampMap& lamps, double row_time_s,
                                     const Stripes& stripes);

}  // namespace vlp
