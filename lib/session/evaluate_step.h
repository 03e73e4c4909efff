// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gate.h"
#include "report/report.h"
#include "session/step_result.h"

namespace vlp {

struct EvaluateResult : StepResult {
  Evaluation evaluation;
  /// Of captures without a fix that no gate asks for, to be said beside the verdict; may be empty.
  std::string caution;
};

/// The distance within which captures are of one place: 1 mm, and what a turn about the
/// calibration's lever arm adds.
double place_radius_m(const Calibration& calibration);

/// What fixes are worth. Metrics: those that can be gates. undetermined: no capture has a fix.
/// Throws InputError when image names do not match.
EvaluateResult evaluate_fixes(const EvaluationInput& input, const std::vector<Gate>& gates);

/// A drive along a commanded line.
struct Drive {
  FromFile<FixRow> fixes;
  CommandedLine commanded_m;
};

/// What a report of fixes shows. References are to what outlives it.
struct EvaluationReport {
  const EvaluationInput& input;
  const EvaluateResult& result;
  LampMap lamps;
  std::vector<Drive> drives;
  /// What else it shows: all gates, of the steps before, too; the calibration, its pictures, how
  /// the fixes were evaluated. report_page() adds title, figures, notes and pictures of the fixes.
  Report page;
};

/// report_html() of all of it. Throws InputError when no line can be fitted to a drive.
std::string report_page(EvaluationReport report);

}  // namespace vlp
