// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-evaluate: evaluates fixes against ground truth, a path or a commanded line.
#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <future>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "captures/csv_reader.h"
#include "evaluation/evaluation.h"
#include "evaluation/evaluation_files.h"
#include "evaluation/gate.h"
#include "evaluation/junit.h"
#include "evaluation/proposed_gates.h"
#include "program/app.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_fixes.h"
#include "program/steps/step_outcome.h"
#include "rig/file.h"
#include "rig/lamp_map_file.h"
#include "session/evaluate_step.h"

namespace vlp {
namespace {

constexpr const char* kName = "vlp-evaluate";

/// Options of the report; no report without a file.
struct ReportOption {
  std::string file;
  std::vector<std::string> pictures;
  /// Fixes of a drive and its commanded line.
  std::vector<std::tuple<std::string, double, double, double, double>> tracks;
};

struct Options {
  std::string fixes, truth, path, compare, lamps, room, calibration, gates_file, json, junit,
      proposed_gates;
  std::vector<double> line_m;  // X0 Y0 X1 Y1
  std::vector<std::string> gates;
  double noise_px = 0;
  std::optional<double> same_point_mm;
  int threads = count_cpu_cores();
  ReportOption report;
};

/// Checks the coordinates X0, Y0, X1, Y1 of a commanded line, m. Throws std::invalid_argument.
void check_line(const std::string& option, const std::array<double, 4>& line_m) {
  if (line_m[0] == line_m[2] && line_m[1] == line_m[3]) {
    throw std::invalid_argument(option + ": start and end of the line are equal; correct them");
  }
  for (const double value_m : line_m) {
    if (std::abs(value_m) > kMaxCoordinate_m) {
      throw std::invalid_argument(option + ": should be within 1,000 km, in meters");
    }
  }
}

std::vector<MetricKind> list_all_metric_kinds() {
  return list_metric_kinds({MetricSource::evaluation, MetricSource::reference});
}

/// Returns the gates of the file and of the command line, which takes precedence.
std::vector<Gate> parse_gates(const Options& options) {
  std::vector<Gate> gates;
  if (!options.gates_file.empty()) gates = read_gates(options.gates_file, list_all_metric_kinds());
  return merge_gates(std::move(gates), parse_gates(options.gates, list_all_metric_kinds()));
}

/// Returns the input files, without those of the report; names may be empty.
std::vector<std::string> list_input_files(const Options& options) {
  return {options.fixes, options.truth,       options.path,      options.compare,
          options.lamps, options.calibration, options.gates_file};
}

/// Checks that no output is given twice or is also an input.
void check_files(const Options& options) {
  std::vector<std::string> inputs = list_input_files(options);
  const ReportOption& report = options.report;
  inputs.insert(inputs.end(), report.pictures.begin(), report.pictures.end());
  for (const auto& track : report.tracks) {
    const auto& [fixes, x0_m, y0_m, x1_m, y1_m] = track;
    inputs.push_back(fixes);
    check_line("--track " + fixes, {x0_m, y0_m, x1_m, y1_m});
  }
  check_outputs_distinct({{"--json", options.json},
                          {"--junit", options.junit},
                          {"--propose-gates", options.proposed_gates},
                          {"--report", report.file}},
                         inputs);
}

void check_options(const Options& options, const std::vector<Gate>& gates) {
  const int references = (options.truth.empty() ? 0 : 1) + (options.path.empty() ? 0 : 1) +
                         (options.line_m.empty() ? 0 : 1);
  if (references != 1) {
    throw std::invalid_argument(
        "the fixes need exactly one reference; give one of --truth, --path, --line");
  }
  if (const auto& line_m = options.line_m; !line_m.empty()) {
    check_line("--line", {line_m[0], line_m[1], line_m[2], line_m[3]});
  }
  if (!options.junit.empty() && gates.empty() && options.compare.empty()) {
    throw std::invalid_argument("--junit: there are no gates; add --gate, --gates or --compare");
  }
  if (std::error_code unknown;
      !options.compare.empty() &&
      std::filesystem::equivalent(options.fixes, options.compare, unknown)) {
    throw std::invalid_argument(
        "--compare: is the file of the fixes itself; give those of another "
        "version, such as accepted ones");
  }
  if (options.noise_px == 0 && options.report.file.empty() && !options.lamps.empty()) {
    throw std::invalid_argument(
        "--lamps: no effect without --noise-px or --report; add one of them");
  }
  if (options.noise_px > 0 && options.truth.empty()) {
    throw std::invalid_argument("--noise-px: the theoretical limit (CRLB) needs --truth; add it");
  }
}

double compute_point_radius_m(const Options& options) {
  if (options.same_point_mm) return 1e-3 * *options.same_point_mm;
  return compute_same_position_radius_m(
      options.calibration.empty() ? Calibration{} : read_calibration(options.calibration));
}

EvaluationInput read_input(const Options& options) {
  EvaluationInput input;
  // The two large tables are read in parallel; if both are bad, the error is that of the fixes.
  auto truth = std::async(options.threads > 1 ? std::launch::async : std::launch::deferred, [&] {
    return options.truth.empty() ? std::vector<TruthRow>() : read_truth_table(options.truth);
  });
  input.fixes = {options.fixes, read_fixes(options.fixes)};
  if (!options.truth.empty()) input.truth = {options.truth, truth.get()};
  if (!options.path.empty()) input.path = read_path_table(options.path);
  if (const auto& line_m = options.line_m; !line_m.empty()) {
    input.line_m = {Eigen::Vector2d{line_m[0], line_m[1]}, Eigen::Vector2d{line_m[2], line_m[3]}};
  }
  input.reference_point_radius_m = compute_point_radius_m(options);
  if (!options.compare.empty()) {
    input.other_fixes = {options.compare, read_fixes(options.compare)};
    check_accepted_fixes(options.compare);
  }
  if (options.noise_px > 0) {
    input.crlb_input = {read_overhead_lamps(options.lamps, options.room),
                        read_calibration(options.calibration).camera, options.noise_px};
  }
  input.threads = options.threads;
  return input;
}

std::string render_report(const CLI::App& app, const Options& options, const EvaluationInput& input,
                          const EvaluateResult& found) {
  EvaluationReport report{input, found, {}, {}, {}};
  report.page.gates = found.gates;
  std::vector<std::string> inputs = list_input_files(options);
  if (!options.lamps.empty()) report.lamps = read_lamps_of_room(options.lamps, options.room);
  if (!options.calibration.empty()) report.page.calibration = read_calibration(options.calibration);
  for (const auto& [fixes, x0_m, y0_m, x1_m, y1_m] : options.report.tracks) {
    report.drives.push_back(
        {{fixes, read_fixes(fixes)}, {Eigen::Vector2d{x0_m, y0_m}, Eigen::Vector2d{x1_m, y1_m}}});
    inputs.push_back(fixes);
  }
  for (const std::string& picture : options.report.pictures) {
    report.page.plots.push_back(read_report_plot(picture));
    inputs.push_back(picture);
  }
  report.page.evaluation = make_command_entry(app, inputs);
  return render_evaluation_html(std::move(report));
}

/// Returns the text of the file of proposed gates. Throws Undetermined if there are too few units.
std::string format_proposal(const EvaluationInput& input, const Evaluation& evaluation) {
  const std::vector<Gate> gates = propose_gates(input, evaluation);
  if (gates.empty()) {
    // [GATE-2] `to propose gates`
    throw Undetermined(
        fmt::format("--propose-gates: too few reference points or captures to propose gates; at "
                    "least {} are needed, add captures",
                    kMinClusters));
  }
  return format_gates(gates, evaluation);
}

/// Returns a test with the warnings, and those of the gates.
std::vector<JUnitTest> make_junit_tests(const EvaluateResult& found) {
  std::vector<JUnitTest> tests = make_gate_tests(found.gates);
  tests.insert(tests.begin(), {"evaluation", JUnitTest::Result::passed, "", "", found.warnings});
  return tests;
}

void run_evaluation(const CLI::App& app, const Options& options, const std::vector<Gate>& gates) {
  const EvaluationInput input = read_input(options);
  const EvaluateResult found = evaluate_with_truth(input, gates);
  require_success(found);
  for (const CheckedMetric& gate : found.gates) {
    if (gate.value) continue;
    throw std::invalid_argument(
        "gate '" + gate.name +
        "': the metric has no value here; remove the gate or give what the metric needs: " +
        find_metric_kind(gate.name)->description);
  }
  std::string report, proposed;
  if (!options.report.file.empty()) report = render_report(app, options, input, found);
  if (!options.proposed_gates.empty()) proposed = format_proposal(input, found.evaluation);
  if (!options.json.empty())
    write_file(options.json, format_evaluation(found.evaluation, found.gates));
  if (!options.junit.empty()) {
    write_file(options.junit, format_junit_xml(kName, make_junit_tests(found)));
  }
  if (!report.empty()) write_file(options.report.file, report);
  if (!proposed.empty()) write_file(options.proposed_gates, proposed);
  print_step_remarks(found);
  print_evaluation(found.evaluation, found.gates);
  const std::string failed = describe_failed_gates(found.gates);
  if (!failed.empty()) throw GateNotMet(failed);
}

/// Writes an error that leaves no gate checked to the JUnit file, which CI reads in place of
/// stderr. Replaces only files of this kind. A file that cannot be written leaves the error as it
/// is.
void write_junit_error(const std::string& file, const char* type, const std::string& message) try {
  constexpr std::size_t max_bytes = 1 << 24;
  if (file.empty() || (std::filesystem::exists(file) &&
                       read_text_file(file, max_bytes).find("<testsuites") == std::string::npos))
    return;
  const JUnitTest test{"evaluation", JUnitTest::Result::error, message, type};
  write_file(file, format_junit_xml(kName, std::span(&test, 1)));
} catch (const std::exception&) {  // the error is reported, not this
}

void run(const CLI::App& app, const Options& options) {
  try {
    check_files(options);
    const std::vector<Gate> gates = parse_gates(options);
    check_options(options, gates);
    run_evaluation(app, options, gates);
  } catch (const GateNotMet&) {
    throw;
  } catch (const Undetermined& error) {
    write_junit_error(options.junit, "undetermined", error.what());
    throw;
  } catch (const std::exception& error) {
    write_junit_error(options.junit, "bad_input", error.what());
    throw;
  }
}

void add_report_options(CLI::App& app, ReportOption& option) {
  auto* report = app.add_option("--report", option.file,
                                "Output file of the report, HTML. With --lamps it has a floor "
                                "plan, with --calibration the calibration");
  app.add_option("--picture", option.pictures,
                 "Plot for the report, .svg or .png, such as --plot of vlp-intrinsics, "
                 "vlp-rotation or vlp-dispersion. Repeat for several")
      ->needs(report)
      ->allow_extra_args(false);
  app.add_option("--track", option.tracks,
                 "Drive for the report: its fixes and the commanded straight line, in m. Repeat "
                 "for several")
      ->needs(report)
      ->option_text("FIXES X0_M Y0_M X1_M Y1_M");
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("fixes", options.fixes, "Fixes to evaluate, fixes.csv of vlp-locate")->required();
  app.add_option("--truth", options.truth,
                 "Ground truth, truth.csv: image, x_m, y_m [, z_m, yaw_rad]. Captures without a "
                 "fix count as missing");
  app.add_option(
      "--path", options.path,
      "Path of the camera, CSV of waypoints: x_m, y_m [, z_m]. Errors are distances from it");
  app.add_option("--line", options.line_m,
                 "Commanded straight line, in m. Errors are distances from it: of the fixes, and "
                 "of a line fitted to them (Chen and Guan)")
      ->expected(4)
      ->check(make_finite_validator())
      ->option_text("X0_M Y0_M X1_M Y1_M");
  app.add_option("--same-point-mm", options.same_point_mm,
                 "Maximum distance between true positions of one reference point, in mm "
                 "(default: 1 plus twice the lever arm of --calibration)")
      ->check(make_positive_validator());
  app.add_option("--compare", options.compare,
                 "Other fixes of the same captures, fixes.csv. Reports better, worse, equivalent "
                 "(within 1 um or 1 % of their mean error, whichever is larger) or inconclusive "
                 "for horizontal, height and yaw error, sd and error / sd. Adds gates of 0 for the "
                 "metrics worse_* and unpaired_fraction; --gate changes them");
  app.add_option("--gate", options.gates,
                 "Limit of a metric. Repeat, or separate by commas, for several")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->option_text("NAME=VALUE");
  app.add_option("--gates", options.gates_file,
                 "File of gates, vlp-gates/1. --gate takes precedence");
  app.add_flag_callback(
      "--strict", [&options] { options.gates.emplace_back("warnings=0"); },
      "Adds the gate warnings=0: each warning fails");
  app.add_option("--json", options.json, "Output file of the metrics, JSON");
  app.add_option(
      "--junit", options.junit,
      "Output file of the checked gates, JUnit XML. Contains an error if they cannot be checked");
  app.add_option("--propose-gates", options.proposed_gates,
                 "Output file of gates that runs of the same accuracy pass, gates.yaml");
  auto* lamps = app.add_option("--lamps", options.lamps,
                               "Lamp map, lamps.yaml, for the report and the theoretical limit "
                               "(CRLB) at the true positions");
  add_room_option(app, options.room);
  auto* calibration = app.add_option("--calibration", options.calibration,
                                     "Calibration of the camera, for the report, for the CRLB (of "
                                     "a level camera), and for the lever arm in --same-point-mm");
  auto* noise = app.add_option("--noise-px", options.noise_px,
                               "Standard deviation of lamp positions in the image, per axis, in "
                               "px. Computes the CRLB")
                    ->check(make_positive_validator());
  noise->needs(lamps)->needs(calibration);
  add_report_options(app, options.report);
  add_threads_option(app, options.threads,
                     "Number of threads for reading and confidence intervals");
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Evaluates fixes against ground truth, a path or a commanded line, and checks gates. Exit "
      "code 1 if a gate fails.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-locate datasets/example/detections.csv \\\n"
      "    --lamps datasets/example/lamps.yaml \\\n"
      "    --calibration datasets/example/calibration.yaml -o fixes.csv\n"
      "  build/bin/vlp-evaluate fixes.csv --truth datasets/example/truth.csv \\\n"
      "    --gate mean_mm=0.2,p90_mm=0.4 --gate missing_fraction=0 \\\n"
      "    --json evaluation.json \\\n"
      "    --calibration datasets/example/calibration.yaml \\\n"
      "    --lamps datasets/example/lamps.yaml --report report.html\n",
      vlp::kName);
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_options(app, options);
  app.footer("Gates:\n" + vlp::describe_metrics(vlp::list_all_metric_kinds()));
  return vlp::parse_and_run(
      app, argc, argv, [&] { vlp::run(app, options); },
      [&](const std::string& message) {
        vlp::write_junit_error(vlp::read_option_value(argc, argv, {"--junit"}), "bad_input",
                               message);
      });
}
