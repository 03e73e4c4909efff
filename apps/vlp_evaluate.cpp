// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-evaluate: what fixes are worth, against a truth, a path or a commanded line.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <future>

#include "app.h"
#include "evaluation/check_gates.h"
#include "evaluation/evaluation.h"
#include "evaluation/evaluation_files.h"
#include "print_evaluation.h"
#include "rig/file.h"

namespace vlp {
namespace {

struct Options {
  std::string fixes, truth, path, compare, lamps, calibration, gates_file, json, junit;
  std::vector<double> line_m;  // X0 Y0 X1 Y1
  std::vector<std::string> gates;
  double noise_px = 0;
  double station_mm = 1;
  int threads = all_cores();
};

/// The files' gates; those of the command line are added, and hold where both say something.
std::vector<Gate> gates_of(const Options& options) {
  std::vector<Gate> gates;
  if (!options.gates_file.empty()) gates = read_gates(options.gates_file);
  const auto from_file = gates.size();
  for (const std::string& text : options.gates) {
    const Gate gate = gate_of(text);
    const auto same = std::find_if(gates.begin(), gates.end(),
                                   [&](const Gate& other) { return other.name == gate.name; });
    if (same == gates.end()) {
      gates.push_back(gate);
    } else if (same < gates.begin() + static_cast<std::ptrdiff_t>(from_file)) {
      same->limit = gate.limit;
    } else {
      throw std::invalid_argument("gate '" + gate.name + "' stands twice");
    }
  }
  return gates;
}

void check_options(const Options& options, const std::vector<Gate>& gates) {
  const int references = (options.truth.empty() ? 0 : 1) + (options.path.empty() ? 0 : 1) +
                         (options.line_m.empty() ? 0 : 1);
  if (references != 1) {
    throw std::invalid_argument(
        "say what to hold the fixes against: one of --truth, --path, --line");
  }
  if (const auto& line_m = options.line_m;
      !line_m.empty() && line_m[0] == line_m[2] && line_m[1] == line_m[3]) {
    throw std::invalid_argument("--line begins where it ends");
  }
  if (!options.junit.empty() && gates.empty()) {
    throw std::invalid_argument(
        "--junit tells of gates, and there are none: add --gate or --gates");
  }
  const std::vector<std::string> inputs{options.fixes,     options.truth, options.path,
                                        options.compare,   options.lamps, options.calibration,
                                        options.gates_file};
  check_output(options.json, inputs);
  check_output(options.junit, inputs);
  if (!options.json.empty() && options.json == options.junit) {
    throw std::invalid_argument("--json and --junit name one file");
  }
}

EvaluationInput input_of(const Options& options) {
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
  input.station_m = 1e-3 * options.station_mm;
  if (!options.compare.empty()) input.others = {options.compare, read_fixes(options.compare)};
  if (!options.lamps.empty()) {
    input.limit = {read_lamp_map(options.lamps), read_calibration(options.calibration).camera,
                   options.noise_px};
  }
  input.threads = options.threads;
  return input;
}

void warn(const EvaluationInput& input, const Evaluation& evaluation) {
  if (input.limit && !evaluation.limit) {
    spdlog::warn("no theoretical limit: the truth has no z_m and yaw_rad, or sees no two lamps");
  }
  if (input.line_m && !evaluation.fit) {
    spdlog::warn("no line is fitted: the fixes are spread in no direction");
  }
  constexpr std::size_t few = 50;
  if (evaluation.intervals_m && evaluation.intervals_m->units < few) {
    spdlog::info("of so few as {} {} intervals are somewhat too narrow, that of p90 most",
                 evaluation.intervals_m->units, evaluation.drawn);
  }
}

void run(const Options& options) {
  const std::vector<Gate> gates = gates_of(options);
  check_options(options, gates);
  const EvaluationInput input = input_of(options);
  const Evaluation evaluation = evaluate(input);
  if (evaluation.fixes == 0) {
    const auto& [status, count] = *evaluation.missing.begin();
    throw Undetermined(fmt::format("{}: not one of {} captures has a fix ({} of them: {})",
                                   options.fixes, evaluation.captures, count, status));
  }
  const std::vector<GateResult> results = check_gates(gates, evaluation);
  if (!options.json.empty()) write_file(options.json, json_of(evaluation, results));
  if (!options.junit.empty()) write_file(options.junit, junit_of(results));
  warn(input, evaluation);
  print_evaluation(evaluation, results);
  std::string failed;
  for (const GateResult& gate : results) {
    if (!gate.passed) failed.append(failed.empty() ? "" : "; ").append(words_of(gate));
  }
  if (!failed.empty()) throw GateNotMet(failed);
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("fixes", options.fixes, "fixes.csv of vlp-locate")->required();
  app.add_option("--truth", options.truth,
                 "truth.csv: image, x_m, y_m [, z_m, yaw_rad]; a capture of it without a fix is "
                 "missing");
  app.add_option("--path", options.path,
                 "The path driven: a CSV of waypoints, x_m, y_m [, z_m]; errors are distances from "
                 "it");
  app.add_option("--line", options.line_m,
                 "The straight line commanded: errors are distances from it, of the fixes and, as "
                 "in the paper, of a line fitted to them")
      ->expected(4)
      ->check(finite())
      ->option_text("X0_M Y0_M X1_M Y1_M");
  app.add_option("--station-mm", options.station_mm,
                 "Captures whose true places are within so much are of one station (default 1)")
      ->check(finite_positive());
  app.add_option("--compare", options.compare,
                 "Other fixes of the same captures: are these better, worse, or is there no "
                 "evidence?");
  app.add_option("--gate", options.gates,
                 "What a figure has to be at most; again for another, or with commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("NAME=VALUE");
  app.add_option("--gates", options.gates_file, "Gates from a file, vlp-gates/1");
  app.add_option("--json", options.json, "Write the figures for programs, evaluation.json");
  app.add_option("--junit", options.junit, "Write the gates for a CI system, JUnit XML");
  auto* lamps =
      app.add_option("--lamps", options.lamps,
                     "Lamp map, lamps.yaml, for the theoretical limit at the true places");
  auto* calibration = app.add_option("--calibration", options.calibration,
                                     "... the camera; the limit is that of a level one");
  auto* noise = app.add_option("--noise-px", options.noise_px,
                               "... and the standard deviation of each lamp's pixel, per axis")
                    ->check(finite_positive());
  lamps->needs(calibration)->needs(noise);
  calibration->needs(lamps);
  noise->needs(lamps);
  app.add_option("--threads", options.threads, "For the intervals (default: one a core)")
      ->check(CLI::Range(1, 1024));
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
      "    --gate mean_mm=0.2,p90_mm=0.4 --gate missing=0 --json evaluation.json\n",
      "vlp-evaluate");
  vlp::Options options;
  vlp::add_options(app, options);
  app.footer("Gates:\n" + vlp::gate_descriptions());
  return vlp::run_app(app, argc, argv, [&] { vlp::run(options); });
}
