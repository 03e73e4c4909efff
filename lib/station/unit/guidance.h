// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/unit/unit.h"

namespace vlp {

/// What there is of a step, drawn with letters, 78 columns wide at most.
std::vector<std::string> progress_of(const Unit& unit, StationStep step);

/// What to do next, in one or two lines of 70 columns at most.
std::string next_of(const Unit& unit, StationStep step);

/// How many of how many: "12/36".
std::string count_of(const Unit& unit, StationStep step);

}  // namespace vlp
