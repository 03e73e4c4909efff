// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"

namespace vlp {

/// Returns, for example, "393 of 432 captures have no fix, and no gate 'missing_fraction' asks".
/// Returns an empty text if every capture has a fix or if a gate limits `missing_fraction`. Empty
/// without gates, too, as no run passes then.
std::string warn_about_missing_fixes(const Evaluation& evaluation,
                                     const std::vector<CheckedMetric>& gates);

/// Returns a warning if the errors are significantly below the theoretical limit
/// (CrlbRatio::are_errors_below_crlb()), one line without a full stop. Empty otherwise. The assumed
/// pixel noise is then too large, or the fixes use more information than one image of a level
/// camera.
std::string warn_about_crlb(const Evaluation& evaluation);

/// Returns warnings about intervals and verdicts from few stations or captures, one line each
/// without a full stop. For a comparison, clusters of the pairs count. Returns none for 50 clusters
/// or more.
std::vector<std::string> warn_about_sample_size(const Evaluation& evaluation);

}  // namespace vlp
