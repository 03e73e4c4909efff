// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"

namespace vlp {

/// Prints an evaluation and its gates to stdout, human-readable, in millimeters and degrees.
void print_evaluation(const Evaluation& evaluation, const std::vector<CheckedMetric>& gates);

}  // namespace vlp
