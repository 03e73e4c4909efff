// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/unit/unit.h"

namespace vlp {

/// Returns the progress of a step as lines, which are not wrapped.
std::vector<std::string> describe_progress(const Unit& unit, StationStep step);

/// Returns the next instruction for the operator in a step, as one line of any length: the next
/// view or capture to take, or the remedy if the step failed.
std::string describe_next_action(const Unit& unit, StationStep step);

/// Returns the number of images and the required number: "12/36".
std::string format_image_count(const Unit& unit, StationStep step);

}  // namespace vlp
