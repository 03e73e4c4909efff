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

/// Result of evaluate_with_truth().
struct EvaluateResult : StepResult {
  Evaluation evaluation;
  /// Warning to be shown next to the verdict, one line, if captures have no fix and no gate limits
  /// their fraction; otherwise empty.
  std::string caution;
};

/// Returns the distance within which captures are at the same place, in m: 1 mm plus twice the
/// length of the calibration's lever arm.
double compute_same_position_radius_m(const Calibration& calibration);

/// Evaluates fixes against ground truth. Metrics: all that gates can limit
/// (collect_metrics()). Failure: undetermined, if no capture has a fix. Throws
/// InputError if the image names do not match.
EvaluateResult evaluate_with_truth(const EvaluationInput& input, const std::vector<Gate>& gates);

/// Fixes of a drive along a commanded straight line, and the ends of this line in the world, m.
struct Drive {
  FileRows<FixRow> fixes;
  CommandedLine commanded_m;
};

/// Content of a report of fixes. The referenced objects must outlive it.
struct EvaluationReport {
  const EvaluationInput& input;
  const EvaluateResult& result;
  LampMap lamps;
  std::vector<Drive> drives;
  /// Other content: the gates of all steps, the calibration, its plots, and the history entry of
  /// the evaluation. render_evaluation_html() adds title, metrics, notes and plots of the
  /// fixes.
  Report page;
};

/// Renders the report as HTML (render_report_html()). Throws InputError if no line can be fitted to
/// a drive.
std::string render_evaluation_html(EvaluationReport report);

}  // namespace vlp
