// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "evaluation/errors/floor_limits.h"
#include "evaluation/evaluation.h"
#include "evaluation/fix_summary.h"
#include "evaluation/gate.h"

namespace vlp {

/// Prints the number of frames with a fix, the reasons why others have none, and the quality of the
/// fixes to stdout.
void print_fix_summary(const FixSummary& summary);

/// Prints an evaluation and its gates to stdout, human-readable: errors in mm and degrees, gates
/// with limit and result.
void print_evaluation(const Evaluation& evaluation, const std::vector<CheckedMetric>& gates);

/// Prints the error budget of a floor to stdout: the median over the floor and the worst place of
/// each source. `is_free`: the camera may move or tilt, which two lamps do not determine
/// everywhere.
void print_floor_budget(const FloorSummary& summary, const FloorLimits& limits, bool is_free);

/// Prints the largest error source and its remedy to stdout.
void print_largest_source(const FloorSummary& summary);

}  // namespace vlp
