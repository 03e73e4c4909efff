// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "positioning/floor_limits.h"
#include "positioning/floor_summary.h"

namespace vlp {

/// The error budget of a floor, on stdout: for each source the median and the worst place.
/// `is_free` is a camera that may move or lean, which not every place with two lamps determines.
void print_limits(const FloorSummary& summary, const FloorLimits& limits, bool is_free);

/// What to improve first, and how.
void print_advice(const FloorSummary& summary);

}  // namespace vlp
