// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "positioning/fix.h"
#include "session/locate_step.h"

namespace vlp {

/// Estimates the fixes of all frames. Uses the noise estimated from the residuals if none is given
/// or the given one is too small, and warns of residuals that motion or tilt explains. Returns true
/// if the noise is known.
bool locate_frames(const LocateInput& input, LocateResult& result);

/// Returns the ids of the rejected lamps, as many as a fix lists.
std::span<const int> list_rejected(const Fix& fix);

/// Returns true if a fix estimates a state, such as kBodyRoll, from its detections.
bool is_state_estimated(const Fix& fix, int state);

}  // namespace vlp
