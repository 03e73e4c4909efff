// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/gate.h"
#include "frontend/observation.h"
#include "frontend/options.h"
#include "session/session_folder.h"
#include "session/step_history.h"
#include "session/step_result.h"

namespace vlp {

// clang-format off
/// The steps of the procedure, in their order. A drive along a line, "line-x", is a step of its own
/// between check and evaluate.
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
  /// Takes the model that the views call for instead (calibration/intrinsics/lens_choice.h).
  bool choose_lens_model = false;
  /// Threads, limits of the images, and the camera's row time and readout direction.
  FrontendOptions frontend = {};
  /// vlp-gates/1 of session_metrics(), for a session that has no gates.yaml of its own; may be
  /// empty. They hold beside lens_gates(), and in their place where they are of the same metric.
  std::filesystem::path gates_file = {};
  /// Pictures, drives along lines and report.html, which take longer than the rest.
  bool report = true;
  /// Steps to run even if nothing has changed.
  std::vector<std::string> redo = {};
};

/// One step of a run, with what it rests on.
struct SessionStep {
  std::string name;
  /// Nothing was done: inputs, options, program and outputs are as they were.
  bool as_before = false;
  StepResult result;
};

enum class SessionVerdict {
  pass,
  gate,      // there is a result, and it misses a gate
  no_result  // a step failed
};

/// The word in session.json: "pass", "gate", "no result".
std::string name_of(SessionVerdict verdict);

struct SessionResult {
  SessionVerdict verdict = SessionVerdict::pass;
  /// Why there is no result, or which gates are not met; empty when it passes.
  std::string reason;
  /// Of the step that failed, or bad_input of a session that is not whole.
  StepFailure failure = StepFailure::none;
  std::vector<SessionStep> steps;
  /// Met and not; those of what was not measured are not met.
  std::vector<CheckedMetric> gates;
  /// As far as it came.
  std::optional<Calibration> calibration;
};

/// What gets to know how far a run is.
struct SessionObserver {
  std::function<void(const std::string& step)> begins = {};
  IntakeProgress progress = {};
  std::function<void(const SessionStep& step)> ends = {};
};

/// What the procedure measures, and what its gates can be of.
std::vector<MetricKind> session_metrics();

/// The whole procedure: calibrates a camera from a session's folder, checks it, and writes a
/// report, all into `results`, which is made when it is not there. A step whose inputs, options and
/// outputs are as when it last ended, with this program, is not run again. What this run does not
/// make, or cannot, is removed. Every file appears whole; killed, the next run goes on.
/// session.json (session_file.h) and junit.xml say how it went, whatever the verdict. What is wrong
/// with the session, a bad file or a step that fails, is in the result; thrown is what is wrong
/// with the options (std::invalid_argument) and with `results` (InputError): a folder of captures,
/// one that another session's results are in or another run is at work in, or that cannot be
/// written.
SessionResult run_session(const std::filesystem::path& session,
                          const std::filesystem::path& results, const SessionOptions& options,
                          const SessionObserver& observer = {});

}  // namespace vlp
