// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/map/map_errors.h"
#include "evaluation/gate.h"
#include "frontend/observation.h"
#include "report/plots/gnuplot.h"
#include "rig/calibration.h"

namespace vlp {

/// Reason why a step of the calibration failed. A step throws InputError for a bad file; a caller
/// that runs several steps converts it to bad_input.
enum class StepFailure {
  none,
  bad_input,     // a file that cannot be used
  undetermined,  // the captures do not determine the answer
  wrong_board,   // the board in the images differs from board.yaml
  wrong_map,     // the captures contradict the lamp map
  wrong_place    // the captures were taken elsewhere than given
};

/// Image that a step did not use: its name, and the reason in one human-readable line.
struct SkippedImage {
  std::string image;
  std::string reason;
};

/// Number of captures in which a lamp was rejected because the other lamps contradict it.
struct RejectedLamp {
  int lamp;
  int captures;
};

/// Outcome common to all steps of the calibration. Texts are human-readable, one line each.
struct StepResult {
  StepFailure failure = StepFailure::none;
  /// Reason of the failure and the remedy, in one line; empty if the step succeeded.
  std::string message = {};
  /// File to correct; empty if the captures are the cause.
  std::filesystem::path file_to_correct = {};

  std::vector<Metric> metrics = {};
  /// Checked gates of some of the metrics, passed and failed.
  std::vector<CheckedMetric> gates = {};
  /// Warnings of possible errors in the result; notes of decisions; details for a closer analysis.
  std::vector<std::string> warnings = {}, notes = {}, details = {};
  /// Captures that do not fit the result, such as those of another camera, in one line; also a
  /// warning. Empty if there are none. An operator at a station has to repeat them.
  std::string inconsistent_captures = {};
  std::vector<SkippedImage> skipped = {};
  std::vector<RejectedLamp> rejected_lamps = {};
  std::vector<LampOffset> lamp_offsets = {};
  /// Calibration with the part of this step; default for steps without one.
  Calibration calibration = {};
  /// Makes the plot of the step on demand; may be empty.
  std::function<Drawing()> drawing = {};

  bool has_succeeded() const { return failure == StepFailure::none; }
  /// Sets failure, message and file to correct.
  void set_step_failure(StepFailure kind, std::string text, std::filesystem::path file = {}) {
    failure = kind;
    message = std::move(text);
    file_to_correct = std::move(file);
  }
  /// Sets inconsistent_captures and warns of them, unless `text` is empty.
  void set_inconsistent_captures(std::string text) {
    if (!text.empty()) warnings.push_back(text);
    inconsistent_captures = std::move(text);
  }
};

/// Returns the name of a failure as in session.json: that of the enumerator, for example
/// "wrong_map".
std::string_view step_failure_name(StepFailure failure);
/// Returns the failure with this name; std::nullopt if there is none.
std::optional<StepFailure> failure_from_name(std::string_view name);

/// Returns the rejected images with their reasons. Names include the folder if there are several
/// folders. Rejected frames of a video are combined to one entry per reason, with their number.
std::vector<SkippedImage> list_skipped_images(const std::vector<Observation>& images);

/// Adds the remarks of an intake to the result of a step: skipped images, warnings, notes, details.
/// Fails the step if no image can be used.
void add_intake_remarks(const Observations& seen, StepResult& result);

/// Returns "FILE: message", or the message alone without a file.
std::string format_failure_message(const StepResult& result);

}  // namespace vlp
