// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"

namespace vlp {

/// Returns gates that a run as good as this one meets: mean_mm, p90_mm, height_rms_mm and
/// yaw_rms_deg as far as they were measured, and missing. Empty if there are fewer than
/// kFewestUnits independent units (FixError::unit).
///
/// The limit of an error is the value measured plus z sqrt(2) times its standard error, which is
/// from its bootstrap interval (error_intervals()). With z = 3.09 another run of the same accuracy
/// exceeds it with a probability of 0.1 %, and of 0.5 % for 40 units, whose intervals are narrow.
/// It is at least 1 % and 1 um (0.001 degrees) above the value, and rounded up to three digits. The
/// limit of `missing` is the fraction measured, rounded up to a millionth.
std::vector<Gate> propose_gates(const EvaluationInput& input, const Evaluation& evaluation);

/// Formats gates as a file `vlp-gates/1`, with the value that each was derived from as a comment.
std::string format_gates(const std::vector<Gate>& gates, const Evaluation& evaluation);

}  // namespace vlp
