// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"

namespace vlp {

/// For example "393 of 432 captures have no fix, and no gate 'missing' asks"; empty when every
/// capture has a fix, when such a gate asks, and without gates, as nothing passes then.
std::string unasked_missing(const Evaluation& evaluation, const std::vector<CheckedMetric>& gates);

/// That the theoretical limit is beaten: the noise it is of is stated too large, or the fixes use
/// more than what it is of, one image of a level camera; empty when it is not. Without a full stop.
std::string warning_of_limit(const Evaluation& evaluation);

/// What so few stations or captures (or, of a comparison, pairs' ones) mean for the intervals and
/// the verdict, a line each without a full stop; none when there are 50 or more.
std::vector<std::string> sample_size_warnings(const Evaluation& evaluation);

}  // namespace vlp
