// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/step_outcome.h"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

#include "program/app.h"
#include "session/step_history.h"

namespace vlp {

namespace {

bool is_result_option(const CLI::Option& option) {
  const auto excluded = list_omitted_options();
  return std::find(excluded.begin(), excluded.end(), option.get_name()) == excluded.end();
}

/// Returns true if the value of the option is the name of an output file.
bool is_output_option(const CLI::Option& option) { return option.get_name() == "--refine-map"; }

std::string format_options(const CLI::App& app, const std::vector<std::string>& inputs) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (option->count() == 0 || option->get_positional() || !is_result_option(*option)) continue;
    text += (text.empty() ? "" : " ") + option->get_name();
    if (option->get_items_expected_max() == 0) continue;  // a flag
    for (const std::string& value : option->results()) {
      const bool file = is_output_option(*option) ||
                        std::find(inputs.begin(), inputs.end(), value) != inputs.end();
      text += " " + (file ? last_component(value) : value);
    }
  }
  return text;
}

}  // namespace

void print_step_remarks(const StepResult& result) {
  for (const std::string& note : result.notes) spdlog::info("{}", note);
  for (const auto& [image, reason] : result.skipped) {
    spdlog::warn("{}{}{}; skipped", image, image.empty() ? "" : ": ", reason);
  }
  for (const std::string& warning : result.warnings) spdlog::warn("{}", warning);
  for (const std::string& detail : result.details) spdlog::debug("{}", detail);
}

void require_success(const StepResult& result) {
  if (result.has_succeeded()) return;
  if (result.failure == StepFailure::undetermined)
    throw Undetermined(format_failure_message(result));
  throw std::invalid_argument(format_failure_message(result));
}

std::span<const std::string_view> list_omitted_options() {
  static constexpr std::array<std::string_view, 15> excluded = {
      "--output",  "--plot",   "--annotate", "--threads", "--quiet",
      "--verbose", "--cache",  "--ros",      "--corners", "--kalibr",
      "--opencv",  "--report", "--json",     "--junit",   "--propose-gates"};
  return excluded;
}

HistoryEntry make_command_entry(const CLI::App& app, const std::vector<std::string>& inputs) {
  InputDigests digests;
  return make_history_entry({app.get_name(), VLP_VERSION}, format_options(app, inputs),
                            {inputs.begin(), inputs.end()}, digests);
}

}  // namespace vlp
