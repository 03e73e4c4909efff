// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/map/lamp_displacements.h"
#include "evaluation/gate.h"
#include "report/plots/gnuplot.h"
#include "rig/calibration.h"

namespace vlp {

/// Why a step of the calibration came to nothing. What is wrong with a single file, a step throws
/// as InputError; who runs steps one after another makes a bad_input of it.
enum class StepFailure {
  none,
  bad_input,     // a file that cannot be used
  undetermined,  // the captures do not determine the answer
  wrong_board,   // the images show another board than board.yaml says
  wrong_map,     // the captures contradict the lamp map
  wrong_place    // the captures were taken elsewhere than is said
};

/// An image that was not used, and why.
struct SkippedImage {
  std::string image;
  std::string reason;
};

/// In how many captures a lamp was left out, because the others contradict it.
struct LampLeftOut {
  int lamp;
  int captures;
};

/// What every step of the calibration tells of how it went; the words are for people, a line each.
struct StepResult {
  StepFailure failure = StepFailure::none;
  /// Why there is no result, and what to add or to correct.
  std::string why = {};
  /// The file that is to be corrected; empty where it is the captures.
  std::filesystem::path subject = {};

  std::vector<Metric> metrics = {};
  /// Of some of them, met and not.
  std::vector<CheckedMetric> gates = {};
  /// What may be wrong though there is a result; what was decided; what is of interest to those who
  /// look closely.
  std::vector<std::string> warnings = {}, notes = {}, details = {};
  std::vector<SkippedImage> skipped = {};
  std::vector<LampLeftOut> lamps_left_out = {};
  std::vector<LampOffset> lamp_offsets = {};
  /// The calibration with the step's part, of the steps that have one.
  Calibration calibration = {};
  /// Makes the step's picture, later; may be empty.
  std::function<Drawing()> drawing = {};

  bool ok() const { return failure == StepFailure::none; }
  void fail(StepFailure how, std::string words, std::filesystem::path file = {}) {
    failure = how;
    why = std::move(words);
    subject = std::move(file);
  }
};

/// The enumerator as a word, for example "wrong_map", and back.
std::string_view name_of(StepFailure failure);
std::optional<StepFailure> step_failure_from_name(std::string_view name);

/// "FILE: why", or, without a file, why.
std::string message_of(const StepResult& result);

}  // namespace vlp
