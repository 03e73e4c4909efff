// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "station/unit/unit.h"
#include "station/verdict.h"

namespace vlp {

/// Returns why a unit does not pass, the most important cause first; empty if it passes. Faults of
/// the station and of the operator come before what was measured with them, so that verdict_of()
/// blames the camera only for its own errors.
std::vector<Cause> find_causes(const Unit& unit);

}  // namespace vlp
