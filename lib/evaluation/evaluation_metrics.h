// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/metric.h"

namespace vlp {

/// Returns the metrics of MetricSource::evaluation and ::reference that were measured, in their
/// order.
std::vector<Metric> collect_metrics(const Evaluation& evaluation);

}  // namespace vlp
