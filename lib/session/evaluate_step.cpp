// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/evaluate_step.h"

#include <fmt/core.h>

#include <algorithm>

#include "evaluation/evaluation_metrics.h"
#include "evaluation/sample_size_warnings.h"
#include "report/evaluation_figures.h"
#include "report/evaluation_pictures.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

void add_drive(Report& report, const Drive& drive) {
  const auto& [fixes, commanded_m] = drive;
  const auto fit = fit_line(fixes.rows, commanded_m);
  if (!fit) {
    throw InputError(fixes.file, "no line can be fitted to its fixes: they have no direction");
  }
  const std::string name = fixes.file.filename().string();
  const auto figures = report_figures(name, *fit);
  report.figures.insert(report.figures.end(), figures.begin(), figures.end());
  report.pictures.push_back(drive_picture(name, fixes.rows, commanded_m, *fit));
}

void add_warnings(EvaluateResult& result, const EvaluationInput& input) {
  const Evaluation& evaluation = result.evaluation;
  if (input.limit && !evaluation.limit) {
    result.warnings.emplace_back(
        "no theoretical limit: the truth has no z_m and yaw_rad, or sees no two lamps");
  }
  if (input.line_m && !evaluation.fit) {
    result.warnings.emplace_back("no line is fitted: the fixes are spread in no direction");
  }
  if (std::string warning = warning_of_limit(evaluation); !warning.empty()) {
    result.warnings.push_back(std::move(warning));
  }
  if (!result.caution.empty()) result.warnings.push_back(result.caution);
  for (std::string& warning : sample_size_warnings(evaluation)) {
    result.notes.push_back(std::move(warning));
  }
}

}  // namespace

double place_radius_m(const Calibration& calibration) {
  constexpr double repeated_m = 1e-3;
  const auto& center = calibration.rotation_center;
  return repeated_m + (center && center->lever_arm_m ? 2 * center->lever_arm_m->norm() : 0);
}

EvaluateResult evaluate_fixes(const EvaluationInput& input, const std::vector<Gate>& gates) {
  EvaluateResult result;
  result.evaluation = evaluate(input);
  const Evaluation& evaluation = result.evaluation;
  if (evaluation.fixes == 0) {
    const auto& [status, count] =
        *std::max_element(evaluation.missing.begin(), evaluation.missing.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
    result.fail(StepFailure::undetermined,
                fmt::format("not one of {} captures has a fix ({} of them: {})",
                            evaluation.captures, count, status),
                input.fixes.file);
    return result;
  }
  result.metrics = metrics_of(evaluation);
  result.gates = check_gates(gates, result.metrics);
  result.caution = unasked_missing(evaluation, result.gates);
  add_warnings(result, input);
  return result;
}

std::string report_page(EvaluationReport subject) {
  Report& report = subject.page;
  report.caution = subject.result.caution;
  report.figures = report_figures(subject.result.evaluation);
  report.notes = report_notes(subject.result.evaluation);
  report.title = "Accuracy report: " + subject.input.fixes.file.filename().string();
  if (report.calibration && !report.calibration->camera.id.empty()) {
    report.title = "Accuracy report: " + report.calibration->camera.id;
  }
  for (const Drive& drive : subject.drives) add_drive(report, drive);
  for (auto& picture :
       evaluation_pictures(subject.input, subject.result.evaluation, subject.lamps)) {
    report.pictures.push_back(std::move(picture));
  }
  if (report.calibration) {
    auto budget = budget_picture(subject.input.fixes.rows, subject.lamps, *report.calibration);
    if (budget) report.pictures.push_back(std::move(*budget));
  }
  if (report.evaluation) report.evaluation->part = "evaluation";
  return report_html(report);
}

}  // namespace vlp
