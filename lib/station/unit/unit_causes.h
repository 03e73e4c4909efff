// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "station/unit/unit.h"
#include "station/verdict.h"

namespace vlp {

/// Returns the reasons why a unit does not pass, the most important one first; empty if it passes.
/// Faults of the station and of the operator precede results that depend on them. The camera
/// therefore fails by decide_verdict() only for its own errors.
std::vector<Cause> find_causes(const Unit& unit);

}  // namespace vlp
