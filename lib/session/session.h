// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/gate.h"
#include "evaluation/verdict.h"
#include "frontend/observation.h"
#include "frontend/options.h"
#include "session/session_folder.h"
#include "session/step_history.h"
#include "session/step_result.h"

namespace vlp {

// clang-format off
/// Options of run_session(). The steps of the procedure, in their order; each drive along a line,
/// "line-x", is a separate step between check and evaluate:
///
///   lens        boards -> lens.yaml, lens.cameramodel, lens.svg      unless there is camera.yaml
///   row-time    rotation -> camera.yaml                              unless the row time is known
///   rotation    rotation -> rotated.yaml, rotation.svg
///   dispersion  dispersion -> calibration.yaml, dispersion.svg       unless there is no dispersion/
///   check       check -> check-fixes.csv                             unless there is no check/
///   line-x      line-x -> line-x-fixes.csv
///   evaluate    -> evaluation.json (with the gates of the errors), report.html
// clang-format on
struct SessionOptions {
  ProgramVersion program;
  std::string camera_id = "camera";
  LensModel lens_model = LensModel::opencv8;
  /// If true, selects the lens model by cross-validation (calibration/intrinsics/lens_choice.h)
  /// instead of using `lens_model`.
  bool choose_lens_model = false;
  /// Threads, limits for images, row time and readout direction of the camera.
  FrontendOptions frontend = {};
  /// File in format vlp-gates/1 with gates of list_session_metrics(), for a session without
  /// its own gates.yaml; may be empty. Its gates are added to make_lens_gates() and to
  /// make_step_gates(), or replace the gates of the same metric.
  std::filesystem::path gates_file = {};
  /// Adds the gate `warnings: 0`.
  bool strict = false;
  /// Makes plots, drives along lines and report.html, which take longer than all other results.
  bool report = true;
  /// Names of steps that are run even if their inputs have not changed.
  std::vector<std::string> steps_to_redo = {};
};

/// Name and result of one step of a run.
struct SessionStep {
  std::string name;
  /// True if the step was not run because its inputs, options, program and outputs are unchanged.
  bool is_up_to_date = false;
  StepResult result;
};

/// Result of run_session().
struct SessionResult {
  /// `fail` if a gate fails, `invalid` if a step failed.
  Verdict verdict = Verdict::pass;
  /// Reason why there is no result, or the failed gates; empty if the session passes.
  std::string reason;
  /// Failure of the step that failed; bad_input if the session is incomplete.
  StepFailure failure = StepFailure::none;
  std::vector<SessionStep> steps;
  /// All gates, passed and failed; gates of metrics without a value fail.
  std::vector<CheckedMetric> gates;
  /// Calibration after the last successful step.
  std::optional<Calibration> calibration;
};

/// Callbacks for the progress of a run: start and end of each step, and images done.
struct SessionObserver {
  std::function<void(const std::string& step)> on_step_started = {};
  IntakeProgress progress = {};
  std::function<void(const SessionStep& step)> on_step_finished = {};
};

/// Runs the whole procedure: calibrates a camera from the folder of a session, checks it, and
/// writes a report. All outputs are written into `results`, which is created if it does not exist.
///
/// A step is skipped if its inputs, options, program and outputs are unchanged since it last ended.
/// Outputs of the last run are replaced or removed when this run ends. Every file is written
/// atomically; after a kill, the next run resumes. session.json (session_file.h) and junit.xml
/// report the outcome for every verdict.
///
/// Errors in the session, such as a bad file or a step that fails, are part of the result.
/// @throws std::invalid_argument if the options are invalid
/// @throws InputError if `session` is not a folder or the file of gates is invalid; if `results`
///     holds captures or the results of another session, is in use by another run, or cannot be
///     written
SessionResult run_session(const std::filesystem::path& session,
                          const std::filesystem::path& results, const SessionOptions& options,
                          const SessionObserver& observer = {});

}  // namespace vlp
