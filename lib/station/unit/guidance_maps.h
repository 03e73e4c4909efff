// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/unit/turn_map.h"
#include "station/unit/unit.h"

namespace vlp {

/// Corners over the image: '#' many, '+' some, '.' none.
std::vector<std::string> board_map(const Unit& unit);

/// The turn on the spot so far; nothing before the lens is known.
TurnMap turn_of(const Unit& unit);
/// Its heights with the angles that are there, and those that are missing.
std::vector<std::string> turn_lines(const Unit& unit);

/// Which lamps the captures of a step show, and which they do not.
std::string lamps_line(const Unit& unit, const UnitStep& step);

}  // namespace vlp
