// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "report/report.h"

namespace vlp {

/// Returns the statistics of an evaluation, formatted for the report.
/// @pre there is at least one fix
std::vector<ReportStatistic> list_statistics(const Evaluation& evaluation);

/// Returns sentences that explain the statistics of a report, one per element. Subjects: reference
/// of the errors, captures without a fix, resampling unit of the intervals, comparison, and
/// warnings about small samples.
std::vector<std::string> make_evaluation_notes(const Evaluation& evaluation);

/// Returns the statistics of a drive: distances of the fitted line, and jitter. Each label begins
/// with the name of the drive.
std::vector<ReportStatistic> list_drive_statistics(const std::string& drive, const LineFit& fit);

}  // namespace vlp
