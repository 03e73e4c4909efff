// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/step_outcome.h"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "program/app.h"

namespace vlp {

void print_remarks(const StepResult& result) {
  for (const std::string& note : result.notes) spdlog::info("{}", note);
  for (const auto& [image, reason] : result.skipped) {
    spdlog::warn("{}{}{}; skipped", image, image.empty() ? "" : ": ", reason);
  }
  for (const std::string& warning : result.warnings) spdlog::warn("{}", warning);
  for (const std::string& detail : result.details) spdlog::debug("{}", detail);
}

void throw_if_failed(const StepResult& result) {
  if (result.ok()) return;
  if (result.failure == StepFailure::undetermined) throw Undetermined(message_of(result));
  throw std::invalid_argument(message_of(result));
}

}  // namespace vlp
