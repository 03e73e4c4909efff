// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"

namespace vlp {

/// Proposes gates that runs of the same accuracy pass: mean_mm, p90_mm, height_rms_mm, yaw_rms_deg
/// (those that were measured) and missing_fraction. Returns none if there are fewer than
/// kMinClusters independent clusters (FixError::cluster).
///
/// The limit of an error is the measured value plus z sqrt(2) times its standard error, which comes
/// from its bootstrap interval (bootstrap_intervals()). With z = 3.09, another run of the
/// same accuracy exceeds it with a probability of 0.1 %. For 40 clusters the probability is 0.5 %,
/// since their standard errors are estimates.
///
/// The margin is at least 1 % and 1 um (0.001 degrees), and limits are rounded up to three digits.
/// The limit of `missing_fraction` is the measured fraction, rounded up to a millionth.
std::vector<Gate> propose_gates(const EvaluationInput& input, const Evaluation& evaluation);

/// Formats gates as the text of a gates file, format `vlp-gates/1` (YAML). A comment after each
/// gate states the measured value from which its limit is derived.
std::string format_gates(const std::vector<Gate>& gates, const Evaluation& evaluation);

}  // namespace vlp
