// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-evaluate: what fixes are worth, against a truth, a path or a commanded line.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <future>

#include "app.h"
#include "evaluate_options.h"
#include "evaluation/cautions.h"
#include "evaluation/check_gates.h"
#include "evaluation/evaluation.h"
#include "evaluation/evaluation_files.h"
#include "print_evaluation.h"
#include "rig/file.h"

namespace vlp {
namespace {

/// Where the camera turns about a lever arm, the places of one station are two of them apart.
double station_m(const EvaluateOptions& options) {
  constexpr double repeated_m = 1e-3;
  if (options.station_mm) return 1e-3 * *options.station_mm;
  if (options.calibration.empty()) return repeated_m;
  const auto center = read_calibration(options.calibration).rotation_center;
  return repeated_m + (center && center->lever_arm_m ? 2 * center->lever_arm_m->norm() : 0);
}

EvaluationInput input_of(const EvaluateOptions& options) {
  EvaluationInput input;
  // The two large tables side by side; of two that are bad the fixes are told of.
  auto truth = std::async(options.threads > 1 ? std::launch::async : std::launch::deferred, [&] {
    return options.truth.empty() ? std::vector<TruthRow>() : read_truth(options.truth);
  });
  input.fixes = {options.fixes, read_fixes(options.fixes)};
  if (!options.truth.empty()) input.truth = {options.truth, truth.get()};
  if (!options.path.empty()) input.path = read_path(options.path);
  if (const auto& line_m = options.line_m; !line_m.empty()) {
    input.line_m = {Eigen::Vector2d{line_m[0], line_m[1]}, Eigen::Vector2d{line_m[2], line_m[3]}};
  }
  input.station_m = station_m(options);
  if (!options.compare.empty()) input.others = {options.compare, read_fixes(options.compare)};
  if (options.noise_px > 0) {
    input.limit = {read_lamp_map(options.lamps), read_calibration(options.calibration).camera,
                   options.noise_px};
  }
  input.threads = options.threads;
  return input;
}

/// Those of stages before come first.
std::vector<GateResult> results_of(const EvaluateOptions& options, const std::vector<Gate>& gates,
                                   const Evaluation& evaluation) {
  std::vector<GateResult> results;
  for (const std::string& text : options.unmet) results.push_back(unmet_gate(text));
  const auto checked = check_gates(gates, evaluation);
  results.insert(results.end(), checked.begin(), checked.end());
  return results;
}

void warn(const EvaluationInput& input, const Evaluation& evaluation, const std::string& missing) {
  if (input.limit && !evaluation.limit) {
    spdlog::warn("no theoretical limit: the truth has no z_m and yaw_rad, or sees no two lamps");
  }
  if (input.line_m && !evaluation.fit) {
    spdlog::warn("no line is fitted: the fixes are spread in no direction");
  }
  if (!missing.empty()) spdlog::warn("{}", missing);
  for (const std::string& caution : cautions_of_few(evaluation)) spdlog::info("{}", caution);
}

void run(const CLI::App& app, const EvaluateOptions& options) {
  const std::vector<Gate> gates = gates_of(options);
  check_evaluate_options(options, gates);
  const EvaluationInput input = input_of(options);
  const Evaluation evaluation = evaluate(input);
  if (evaluation.fixes == 0) {
    const auto& [status, count] =
        *std::max_element(evaluation.missing.begin(), evaluation.missing.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
    throw Undetermined(fmt::format("{}: not one of {} captures has a fix ({} of them: {})",
                                   options.fixes, evaluation.captures, count, status));
  }
  const std::vector<GateResult> results = results_of(options, gates, evaluation);
  const std::string missing = unasked_missing(evaluation, results);
  std::string report;
  if (!options.report.file.empty()) {
    report = report_of(app, options.report,
                       {input, evaluation, results, missing, options.lamps, options.calibration,
                        inputs_of(options)});
  }
  if (!options.json.empty()) write_file(options.json, json_of(evaluation, results));
  if (!options.junit.empty()) write_file(options.junit, junit_of(results));
  if (!report.empty()) write_file(options.report.file, report);
  warn(input, evaluation, missing);
  print_evaluation(evaluation, results);
  std::string failed;
  for (const GateResult& gate : results) {
    if (!gate.passed) failed.append(failed.empty() ? "" : "; ").append(words_of(gate));
  }
  if (!failed.empty()) throw GateNotMet(failed);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "What fixes are worth: their errors against a truth, a path or a commanded line, and gates\n"
      "for them. Exit code 1 when a gate is not met.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-locate datasets/example/detections.csv --lamps datasets/example/lamps.yaml "
      "\\\n"
      "    --calibration datasets/example/calibration.yaml -o fixes.csv\n"
      "  build/bin/vlp-evaluate fixes.csv --truth datasets/example/truth.csv \\\n"
      "    --gate mean_mm=0.2,p90_mm=0.4 --gate missing=0 --json evaluation.json \\\n"
      "    --calibration datasets/example/calibration.yaml --lamps datasets/example/lamps.yaml \\\n"
      "    --report report.html\n",
      "vlp-evaluate");
  vlp::EvaluateOptions options;
  vlp::add_evaluate_options(app, options);
  app.footer("Gates:\n" + vlp::gate_descriptions());
  return vlp::run_app(app, argc, argv, [&] { vlp::run(app, options); });
}
