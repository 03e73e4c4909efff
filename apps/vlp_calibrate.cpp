// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-calibrate: runs the whole procedure on the folder of a session: calibration, fixes, report.

#include <CLI/CLI.hpp>
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
  const SessionResult result =
      run_session(options.session, options.results, options.how, log.observer());
  if (result.verdict == SessionVerdict::no_result) {
    if (result.failure == StepFailure::undetermined) throw Undetermined(result.reason);
    throw std::invalid_argument(result.reason);
  }
  print_session(result, options.results);
  if (result.verdict == SessionVerdict::gate) throw GateNotMet(result.reason);
}

int calibrate(int argc, char** argv) {
  CLI::App app(
      "Calibrates a camera from a folder of its captures, checks it, and writes a report: the\n"
      "steps lens, row-time, rotation, dispersion, check, evaluate. A step whose inputs, options\n"
      "and outputs are as before is not run again; killed, the same command goes on.\n\n"
      "SESSION, which is only read, holds\n"
      "  lamps.yaml            the lamps, with their frequencies\n"
      "  boards/, board.yaml   images of the board, and what it is; or camera.yaml,\n"
      "                        the camera part of a calibration\n"
      "  rotation/             captures while the camera turns on the spot\n"
      "  dispersion/           at known places, turning; captures.csv says where\n"
      "                        (optional)\n"
      "  check/                to locate; with truth.csv, or places in captures.csv,\n"
      "                        also the errors and the report (optional)\n"
      "  line-*/               along a straight line each, with places (optional)\n"
      "  classifier.yaml       of vlp-train, to tell the lamps apart (optional)\n"
      "  gates.yaml            what the figures have to keep to (optional)\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-simulate datasets/paper-rig/scene.yaml \\\n"
      "    --only boards,rotation,dispersion,check -o out/session\n"
      "  build/bin/vlp-calibrate out/session --row-time-s 3e-5 --readout rows \\\n"
      "    -o out/results\n",
      kName);
  Options options;
  auto& how = options.how;
  how.frontend = make_default_frontend();
  app.add_option("session", options.session, "Folder of the captures")->required();
  app.add_option("-o,--output", options.results,
                 "Folder for calibration.yaml, check-fixes.csv, evaluation.json, report.html, "
                 "session.json and what each step wrote; made when it is not there")
      ->required();
  app.add_option("--camera-id", how.camera_id, "Name of the camera (default: camera)");
  add_lens_option(app, options.lens);
  app.add_option("--row-time-s", how.frontend.row_time_s,
                 "Time from one row of the read-out to the next (default: found from rotation)")
      ->check(CLI::Range(1e-8, 1e-3));
  add_readout_option(app, how.frontend.readout);
  add_room_option(app, how.frontend.room);
  add_board_limit_options(app, how.frontend);
  app.add_option("--gates", how.gates_file,
                 "Gates, vlp-gates/1, for a session that has no gates.yaml; of the lens there are "
                 "some in any case");
  app.add_flag("--report,!--no-report", how.report,
               "Draw pictures and write report.html (default), or not");
  app.add_option("--redo", how.redo, "Run a step again though nothing has changed")
      ->option_text("STEP ...");
  add_threads_option(app, how.frontend.threads);
  app.add_flag(
      "--batch-stdin",
      [](std::int64_t) { throw CLI::ValidationError("--batch-stdin", "stands alone"); },
      "Alone: do what stdin says, a line of JSON for each session; see apps/vlp-calibrate.md");
  app.footer("Gates:\n" + gate_descriptions(session_metrics()));
  return run_app(app, argc, argv, [&] { run(options); });
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  if (argc != 2 || std::string_view(argv[1]) != "--batch-stdin") return vlp::calibrate(argc, argv);
  CLI::App app("", vlp::kName);
  return vlp::run_app(app, 1, argv, [] {
    vlp::prepare_tag_family("tag36h11");  // family of most boards
    vlp::run_each(vlp::kName, vlp::calibrate);
  });
}
