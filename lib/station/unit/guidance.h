// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/unit/turn_map.h"
#include "station/unit/unit.h"

namespace vlp {

/// Returns the progress of a step as text of at most 78 columns.
std::vector<std::string> describe_progress(const Unit& unit, StationStep step);

/// Returns the next instruction for the operator, in one or two lines of at most 70 columns.
std::string describe_next_action(const Unit& unit, StationStep step);

/// Returns the number of images and the required number: "12/36".
std::string format_count(const Unit& unit, StationStep step);

/// Returns a map of the corners over the image: '#' many, '+' some, '.' none.
std::vector<std::string> draw_board_map(const Unit& unit);

/// Returns the covered angles of the rotation in place; empty before the lens is known.
TurnMap compute_unit_turn_map(const Unit& unit);
/// Returns the heights of the rotation with covered and missing angles, as lines.
std::vector<std::string> describe_turn(const Unit& unit);

/// Returns a line with the lamps that the captures of a step contain, and the missing ones.
std::string describe_lamps(const Unit& unit, const UnitStep& step);

}  // namespace vlp
