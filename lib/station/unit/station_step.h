// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace vlp {

/// Steps of a station, in this order. Each has a folder of its name.
enum class StationStep { boards, rotation, dispersion, check };

inline constexpr std::array kStationSteps{StationStep::boards, StationStep::rotation,
                                          StationStep::dispersion, StationStep::check};

constexpr const char* to_string(StationStep step) {
  constexpr std::array names{"boards", "rotation", "dispersion", "check"};
  return names[static_cast<std::size_t>(step)];
}

}  // namespace vlp
