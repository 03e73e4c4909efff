// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "positioning/floor_limits.h"
#include "positioning/floor_summary.h"

namespace vlp {

/// Prints the error budget of a floor to stdout: the median over the floor and the worst place of
/// each source. `is_free`: the camera may move or tilt, which two lamps do not determine
/// everywhere.
void print_limits(const FloorSummary& summary, const FloorLimits& limits, bool is_free);

/// Prints the largest error source and its remedy to stdout.
void print_advice(const FloorSummary& summary);

}  // namespace vlp
