// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"

namespace vlp {

/// `evaluation.json`, for programs: format "vlp-evaluation/1". Every key ends in the unit of its
/// figure (_mm, _deg, _m); shares and ratios have none, counts are called after what they count.
/// What there is not is left out. Errors have mean, median, p90, max and rms; intervals are of 95
/// %. A
/// comparison of too few units has a "why". Objects: horizontal (with intervals_95 and cdf), height
/// and yaw (with bias), repeated (bias and scatter of stations with two fixes or more, and the
/// list), fitted_line (of --line; jitter, angle, ends), stated_ratio (errors / stated sd), limit
/// (errors / theoretical limit, and whether that is beaten), comparison (verdict, pairs,
/// difference, and the least that matters), gates (name, unit, value, limit, asked: "at most" or
/// "at least", passed), passed.
std::string json_of(const Evaluation& evaluation, const std::vector<CheckedMetric>& gates);

}  // namespace vlp
