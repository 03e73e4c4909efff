// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-calibrate: runs the whole procedure on the folder of a session: calibration, fixes, report.

#include <CLI/CLI.hpp>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "detection/boards/board_detector.h"
#include "evaluation/gate.h"
#include "program/app.h"
#include "program/run_each.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_session.h"
#include "session/session.h"
#include "session/session_gates.h"
#include "session/session_results.h"

namespace vlp {
namespace {

constexpr const char* kName = "vlp-calibrate";

struct Options {
  std::string session, results, lens = "LENSMODEL_OPENCV8";
  SessionOptions how;
};

void run(Options options) {
  options.how.choose_lens_model = options.lens == kAutomaticLens;
  if (const auto model = lens_model_from_name(options.lens)) options.how.lens_model = *model;
  options.how.program = {kName, VLP_VERSION};
  SessionLog log;
  const SessionResult result = [&] {
    try {
      return run_session(options.session, options.results, options.how, log.make_observer());
    } catch (const std::exception& error) {
      write_refusal_junit(options.results, options.session, error.what());
      throw;
    }
  }();
  if (result.verdict == Verdict::invalid) {
    if (result.failure == StepFailure::undetermined) throw Undetermined(result.reason);
    throw std::invalid_argument(result.reason);
  }
  print_session(result, options.results);
  if (result.verdict == Verdict::fail) throw GateNotMet(result.reason);
}

int calibrate(int argc, char** argv) {
  const auto parser = make_app(
      "Calibrates a camera from a folder of its captures, evaluates it, and writes a report. Runs "
      "the steps lens, row-time, rotation, dispersion, check, one per line-*, and evaluate. Skips "
      "a step if its inputs, options and outputs are unchanged. After an interruption the same "
      "command continues.\n\n"
      "The input folder SESSION is not modified. It contains:\n"
      "  lamps.yaml            lamp map with frequencies\n"
      "  boards/, board.yaml   images of the board and its description; or\n"
      "  camera.yaml           camera part of a calibration, used instead of boards/\n"
      "  rotation/             captures while the camera rotates in place\n"
      "  dispersion/           captures at several yaws, with positions in captures.csv\n"
      "                        or truth.csv (optional)\n"
      "  check/                captures to locate (optional); errors and report need\n"
      "                        positions in truth.csv or captures.csv\n"
      "  line-*/               captures along a straight line, with positions\n"
      "                        (optional)\n"
      "  classifier.yaml       lamp classifier of vlp-train (optional)\n"
      "  gates.yaml            limits of the metrics (optional)\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-simulate datasets/paper-rig/scene.yaml \\\n"
      "    --only boards,rotation,dispersion,check -o out/session\n"
      "  build/bin/vlp-calibrate out/session --row-time-s 3e-5 --readout rows \\\n"
      "    -o out/results\n",
      kName);
  CLI::App& app = *parser;
  Options options;
  auto& how = options.how;
  how.frontend = make_intake_options();
  app.add_option("session", options.session, "Input folder of the captures")->required();
  app.add_option("-o,--output", options.results,
                 "Output folder, created if missing: calibration.yaml, check-fixes.csv, "
                 "evaluation.json, report.html, session.json, junit.xml and the files of each step")
      ->required();
  app.add_option("--camera-id", how.camera_id, "Camera id in the calibration (default: camera)");
  add_lens_model(app, options.lens);
  app.add_option("--row-time-s", how.frontend.row_time_s,
                 "Row time: time between the readout of successive rows, in s (default: estimated "
                 "from rotation/)")
      ->check(CLI::Range(1e-8, 1e-3));
  add_readout(app, how.frontend.readout);
  add_room_option(app, how.frontend.room);
  add_quality_options(app, how.frontend);
  app.add_option("--gates", how.gates_file,
                 "File of gates, vlp-gates/1, for sessions without gates.yaml. Its gates are added "
                 "to the default gates, or replace them");
  app.add_flag("--strict", how.strict, "Adds the gate warnings=0: each warning fails");
  app.add_flag("--report,!--no-report", how.report, "Write plots and report.html (default: yes)");
  app.add_option("--redo", how.steps_to_redo, "Steps to run even if nothing has changed")
      ->option_text("STEP ...");
  add_threads_option(app, how.frontend.threads);
  app.add_flag(
      "--batch-stdin",
      [](std::int64_t) {
        throw CLI::ValidationError("--batch-stdin", "excludes all other arguments; give it alone");
      },
      "Read requests from stdin, one line of JSON for each session; see apps/vlp-calibrate.md. "
      "Excludes all other arguments");
  app.footer("Gates:\n" + describe_metrics(list_session_metrics()));
  return parse_and_run(
      app, argc, argv, [&] { run(options); },
      [&](const std::string& message) {
        write_refusal_junit(read_option_value(argc, argv, {"-o", "--output"}), {}, message);
      });
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  if (argc != 2 || std::string_view(argv[1]) != "--batch-stdin") return vlp::calibrate(argc, argv);
  const auto parser = vlp::make_app("", vlp::kName);
  CLI::App& app = *parser;
  return vlp::parse_and_run(app, 1, argv, [] {
    vlp::load_tag_family("tag36h11");  // family of most boards
    vlp::run_each_line(vlp::kName, vlp::calibrate);
  });
}
