// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/step_result.h"

#include <array>
#include <utility>

#include "rig/input_error.h"

namespace vlp {
namespace {

constexpr std::array<std::pair<StepFailure, std::string_view>, 6> kNames{
    {{StepFailure::none, "none"},
     {StepFailure::bad_input, "bad_input"},
     {StepFailure::undetermined, "undetermined"},
     {StepFailure::wrong_board, "wrong_board"},
     {StepFailure::wrong_map, "wrong_map"},
     {StepFailure::wrong_place, "wrong_place"}}};

}  // namespace

std::string_view to_string(StepFailure failure) {
  for (const auto& [known, name] : kNames) {
    if (known == failure) return name;
  }
  return "";
}

std::optional<StepFailure> step_failure_from_name(std::string_view name) {
  for (const auto& [failure, known] : kNames) {
    if (known == name) return failure;
  }
  return std::nullopt;
}

std::string message_of(const StepResult& result) {
  return result.subject.empty() ? result.why : InputError(result.subject, result.why).what();
}

}  // namespace vlp
