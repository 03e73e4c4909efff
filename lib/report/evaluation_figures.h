// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "report/report.h"

namespace vlp {

/// The figures of an evaluation as the report words them. Precondition: there is a fix.
std::vector<ReportFigure> report_figures(const Evaluation& evaluation);

/// Sentences to go with them: captures without a fix, what the intervals drew, the comparison,
/// what few stations or captures mean.
std::vector<std::string> report_notes(const Evaluation& evaluation);

/// Of a drive: the fitted line's distances and the jitter; begins with the drive's name.
std::vector<ReportFigure> report_figures(const std::string& drive, const LineFit& fit);

}  // namespace vlp
