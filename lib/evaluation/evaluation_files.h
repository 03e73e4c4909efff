// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"

namespace vlp {

/// Formats an evaluation as machine-readable JSON: the content of `evaluation.json`, format
/// "vlp-evaluation/4".
///
/// Every key ends in the unit of its value (_mm, _deg, _m). Fractions and ratios have no unit.
/// Counts are named after what they count. Missing parts are omitted. Errors have mean, median,
/// p90, max and rms. Intervals are 95 % confidence intervals. A comparison with too few clusters
/// has a "reason". Objects:
///   horizontal    with intervals_95 and cdf
///   height, yaw   with bias
///   repeated      bias and scatter of stations with two fixes or more, and the list of stations
///   fitted_line   of --line; jitter, angle, ends
///   normalized_error_rms  errors / reported standard deviation
///   limit         errors / theoretical limit, and whether they are below it
///   comparison    verdict, captures in one file only; for each quantity its verdict, pairs,
///                 difference, and the smallest difference that matters
///   gates         name, unit, value, limit, direction ("at most" or "at least"), passed
///   passed        true if all gates are passed
std::string format_evaluation(const Evaluation& evaluation,
                              const std::vector<CheckedMetric>& gates);

/// Checks that accepted fixes are unchanged since scripts/ci/accept-fixes.sh recorded their digest
/// in FIXES.origin, if there is such a file.
/// @throws InputError if the digest differs or is missing
void check_accepted_fixes(const std::filesystem::path& fixes);

}  // namespace vlp
