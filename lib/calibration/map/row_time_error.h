// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "rig/lamp_map.h"

namespace vlp {

/// Finds the row time with which lights that match no lamp are lamps of the map.
///
/// @param frequencies_hz  of the lights, measured with `row_time_s`: f' = f true row time /
///                        row_time_s
/// @return  the row time, in s. std::nullopt unless four fifths of the lights match three lamps or
///          more to 1 %, or if it is beyond 40 % of `row_time_s`. Also std::nullopt within
///          kMaxUnclearDrift of it: then the lights match two lamps each, not none.
std::optional<double> find_true_row_time(std::span<const double> frequencies_hz, const LampMap& map,
                                         double row_time_s);

}  // namespace vlp
