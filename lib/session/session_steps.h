// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "evaluation/gate.h"
#include "frontend/observation.h"
#include "session/session.h"
#include "session/session_folder.h"
#include "session/session_results.h"
#include "session/step_history.h"
#include "session/step_result.h"

namespace vlp {

/// State of a session while its steps run. The referenced objects must outlive it.
struct SessionState {
  const SessionFolder& session;
  SessionResults& results;
  const SessionOptions& options;
  const SessionObserver& observer;
  std::vector<Gate> gates;
  /// Path of the calibration by the last step; before the first step that of the session's
  /// camera.yaml, or empty.
  std::filesystem::path calibration_file;
  /// Steps and gates so far, and the calibration by the last step.
  SessionResult result = {};
  InputDigests digests = {};

  /// Returns the path of an output.
  std::filesystem::path output_file(const std::string& name) const;
  /// Returns the folders of the drives to locate along lines; none without a report.
  std::vector<std::filesystem::path> list_line_drives() const;
  /// Returns the gates of a step, checked.
  std::vector<CheckedMetric> check_step_gates(const std::string& step,
                                              const std::vector<Metric>& metrics) const;
  /// Sets the metric `warnings` of the last step to the number of warnings of all steps.
  void add_warnings_metric(StepResult& last) const;
};

/// Files, folders and options that determine the result of a step.
struct StepInputs {
  std::vector<std::filesystem::path> files;
  std::string options = {};
};

/// Result of a step, and the function that writes its outputs other than calibration and plot.
struct StepWork {
  StepResult result;
  std::function<void()> write = [] {};
};

/// Step of a session: captures, outputs, and the functions that list its inputs and solve it.
struct SessionStepPlan {
  std::string name;
  /// Folder of the captures; empty: none.
  std::filesystem::path captures;
  StepInputs (*list_inputs)(const SessionState& state, const SessionStepPlan& step);
  StepWork (*solve)(SessionState& state, const SessionStepPlan& step,
                    const std::vector<std::filesystem::path>& inputs);
  /// Names of the outputs: calibration and its plot, and other files; empty: none.
  std::string calibration = {}, plot = {};
  std::vector<std::string> files = {};
};

/// Returns the steps of a session in their order. Each uses the calibration by the step before.
std::vector<SessionStepPlan> plan_session_steps(const SessionState& state);

/// Returns false for row-time if the row time is known or not required, and for dispersion if there
/// are no captures.
bool is_step_needed(const SessionState& state, const SessionStepPlan& step);

/// Replaces the reason of a step with lamps that failed if the images show stripes along another
/// direction than the readout direction of the camera.
void add_readout_remark(const SessionState& state, StepResult& result);

}  // namespace vlp
