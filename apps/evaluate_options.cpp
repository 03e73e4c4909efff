// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluate_options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "captures/csv_reader.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

/// What a report and XML can say: UTF-8 without control characters.
CLI::Validator one_line() {
  return {[](std::string& text) {
            const bool control = std::any_of(
                text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == '\x7f'; });
            return !text.empty() && !control && utf8_length(text) == text.size()
                       ? ""
                       : "should be one line of UTF-8 text";
          },
          ""};
}

/// X0, Y0, X1, Y1.
void check_line(const std::string& option, const std::array<double, 4>& line_m) {
  if (line_m[0] == line_m[2] && line_m[1] == line_m[3]) {
    throw std::invalid_argument(option + ": the line begins where it ends");
  }
  for (const double value_m : line_m) {
    if (std::abs(value_m) > kFarthest_m) {
      throw std::invalid_argument(option + ": should be within 1,000 km, in metres");
    }
  }
}

/// Outputs, which need not exist; empty: none.
bool same_file(const std::string& one, const std::string& other) {
  const auto of = [](const std::string& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file));
  };
  return !one.empty() && !other.empty() && of(one) == of(other);
}

}  // namespace

std::vector<Gate> gates_of(const EvaluateOptions& options) {
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

std::vector<std::string> inputs_of(const EvaluateOptions& options) {
  return {options.fixes, options.truth,       options.path,      options.compare,
          options.lamps, options.calibration, options.gates_file};
}

void check_evaluate_options(const EvaluateOptions& options, const std::vector<Gate>& gates) {
  const int references = (options.truth.empty() ? 0 : 1) + (options.path.empty() ? 0 : 1) +
                         (options.line_m.empty() ? 0 : 1);
  if (references != 1) {
    throw std::invalid_argument(
        "say what to hold the fixes against: one of --truth, --path, --line");
  }
  if (const auto& line_m = options.line_m; !line_m.empty()) {
    check_line("--line", {line_m[0], line_m[1], line_m[2], line_m[3]});
  }
  if (!options.junit.empty() && gates.empty() && options.unmet.empty()) {
    throw std::invalid_argument(
        "--junit tells of gates, and there are none: add --gate or --gates");
  }
  if (options.noise_px == 0 && options.report.file.empty() && !options.lamps.empty()) {
    throw std::invalid_argument("--lamps is for the theoretical limit, which needs --noise-px");
  }
  if (options.noise_px > 0 && options.truth.empty()) {
    throw std::invalid_argument("--noise-px is for the theoretical limit, which needs --truth");
  }
  std::vector<std::string> inputs = inputs_of(options);
  const ReportOption& report = options.report;
  inputs.insert(inputs.end(), report.pictures.begin(), report.pictures.end());
  for (const auto& track : report.tracks) {
    const auto& [fixes, x0_m, y0_m, x1_m, y1_m] = track;
    inputs.push_back(fixes);
    check_line("--track " + fixes, {x0_m, y0_m, x1_m, y1_m});
  }
  check_output(options.json, inputs);
  check_output(options.junit, inputs);
  check_output(report.file, inputs);
  if (same_file(options.json, options.junit)) {
    throw std::invalid_argument("--json and --junit name one file");
  }
  if (same_file(report.file, options.json) || same_file(report.file, options.junit)) {
    throw std::invalid_argument("--report and another output name one file");
  }
}

void add_evaluate_options(CLI::App& app, EvaluateOptions& options) {
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
  app.add_option(
         "--station-mm", options.station_mm,
         "Captures whose true places are within so much are of one station (default: 1, and "
         "what a turn about the calibration's lever arm adds)")
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
  app.add_option("--unmet", options.unmet,
                 "A gate that was not met before, e.g. of vlp-intrinsics: makes the verdict FAIL; "
                 "again for another")
      ->allow_extra_args(false)
      ->check(one_line())
      ->option_text("TEXT");
  app.add_option("--json", options.json, "Write the figures for programs, evaluation.json");
  app.add_option("--junit", options.junit, "Write the gates for a CI system, JUnit XML");
  auto* lamps = app.add_option(
      "--lamps", options.lamps,
      "Lamp map, lamps.yaml, for the theoretical limit at the true places, and the report");
  auto* calibration = app.add_option("--calibration", options.calibration,
                                     "... the camera; the limit is that of a level one; its "
                                     "lever arm is for --station-mm");
  auto* noise = app.add_option("--noise-px", options.noise_px,
                               "... and the standard deviation of each lamp's pixel, per axis")
                    ->check(finite_positive());
  noise->needs(lamps)->needs(calibration);
  add_report_options(app, options.report);
  app.add_option("--threads", options.threads, "For the intervals (default: one a core)")
      ->check(CLI::Range(1, 1024));
}

}  // namespace vlp
