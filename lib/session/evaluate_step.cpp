// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/evaluate_step.h"

#include <fmt/core.h>

#include <algorithm>

#include "evaluation/evaluation.h"
#include "evaluation/sample_size_warnings.h"
#include "report/evaluation_figures.h"
#include "report/evaluation_pictures.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

void add_line_drive(Report& report, const Drive& drive) {
  const auto& [fixes, commanded_m] = drive;
  const auto fit = fit_line_to_fixes(fixes.rows, commanded_m);
  if (!fit) {
    throw InputError(fixes.file,
                     "no line can be fitted to its fixes: they do not determine a direction");
  }
  const std::string name = fixes.file.filename().string();
  const auto metrics = list_drive_statistics(name, *fit);
  report.metrics.insert(report.metrics.end(), metrics.begin(), metrics.end());
  report.plots.push_back(make_drive_plot(name, fixes.rows, commanded_m, *fit));
}

void add_warnings(EvaluateResult& result, const EvaluationInput& input) {
  const Evaluation& evaluation = result.evaluation;
  if (input.crlb_input && !evaluation.crlb_ratio) {
    result.warnings.emplace_back(
        "no theoretical limit: the ground truth has no z_m and yaw_rad, or two lamps are visible "
        "from none of its positions");
  }
  if (input.line_m && !evaluation.line_fit) {
    result.warnings.emplace_back("no line is fitted: the fixes do not determine a direction");
  }
  if (std::string warning = warn_about_crlb(evaluation); !warning.empty()) {
    result.warnings.push_back(std::move(warning));
  }
  if (!result.caution.empty()) result.warnings.push_back(result.caution);
  result.warnings.insert(result.warnings.end(), evaluation.systematic_errors.begin(),
                         evaluation.systematic_errors.end());
  if (const auto& comparison = evaluation.comparison;
      comparison && comparison->horizontal().has_too_few_clusters()) {
    // [GATE-2] `a change from chance`
    result.warnings.emplace_back(
        "too few reference points or captures to distinguish a change from chance");
  }
  for (std::string& warning : warn_about_sample_size(evaluation)) {
    result.notes.push_back(std::move(warning));
  }
}

}  // namespace

double compute_same_position_radius_m(const Calibration& calibration) {
  constexpr double repeated_m = 1e-3;
  const auto& center = calibration.rotation_center;
  return repeated_m + (center && center->lever_arm_m ? 2 * center->lever_arm_m->norm() : 0);
}

EvaluateResult evaluate_with_truth(const EvaluationInput& input,
                                   const std::vector<Gate>& given_gates) {
  EvaluateResult result;
  result.evaluation = evaluate_fixes(input);
  const Evaluation& evaluation = result.evaluation;
  if (evaluation.fixes == 0) {
    const auto& [status, count] = *std::max_element(
        evaluation.failures_by_status.begin(), evaluation.failures_by_status.end(),
        [](const auto& a, const auto& b) { return a.second < b.second; });
    result.set_step_failure(StepFailure::undetermined,
                            fmt::format("none of {} captures has a fix ({} of them: {})",
                                        evaluation.captures, count, status),
                            input.fixes.file);
    return result;
  }
  result.metrics = collect_metrics(evaluation);
  const auto gates = merge_gates(make_comparison_gates(result.metrics), given_gates);
  result.caution = warn_about_missing_fixes(evaluation, check_gates(gates, result.metrics));
  add_warnings(result, input);
  result.metrics.push_back({"warnings", static_cast<double>(result.warnings.size())});
  result.gates = check_gates(gates, result.metrics);
  return result;
}

std::string render_evaluation_html(EvaluationReport report_content) {
  Report& report = report_content.page;
  report.caution = report_content.result.caution;
  report.metrics = list_statistics(report_content.result.evaluation);
  report.notes = make_evaluation_notes(report_content.result.evaluation);
  report.title = "Accuracy report: " + report_content.input.fixes.file.filename().string();
  if (report.calibration && !report.calibration->camera.id.empty()) {
    report.title = "Accuracy report: " + report.calibration->camera.id;
  }
  for (const Drive& drive : report_content.drives) add_line_drive(report, drive);
  for (auto& picture : make_error_plots(report_content.input, report_content.result.evaluation,
                                        report_content.lamps)) {
    report.plots.push_back(std::move(picture));
  }
  if (report.calibration) {
    auto budget = make_budget_plot(report_content.input.fixes.rows, report_content.lamps,
                                   *report.calibration);
    if (budget) report.plots.push_back(std::move(*budget));
  }
  if (report.evaluation) report.evaluation->part = "evaluation";
  render_plots(report.plots);
  return render_report_html(report);
}

}  // namespace vlp
