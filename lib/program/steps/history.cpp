// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/history.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <string_view>

#include "session/step_history.h"

namespace vlp {
namespace {

bool changes_the_result(const CLI::Option& option) {
  const auto others = options_without_history();
  return std::find(others.begin(), others.end(), option.get_name()) == others.end();
}

/// Returns true if the value of the option is the name of an output file.
bool names_output(const CLI::Option& option) { return option.get_name() == "--refine-map"; }

std::string options_of(const CLI::App& app, const std::vector<std::string>& inputs) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (option->count() == 0 || option->get_positional() || !changes_the_result(*option)) continue;
    text += (text.empty() ? "" : " ") + option->get_name();
    if (option->get_items_expected_max() == 0) continue;  // a flag
    for (const std::string& value : option->results()) {
      const bool file =
          names_output(*option) || std::find(inputs.begin(), inputs.end(), value) != inputs.end();
      text += " " + (file ? last_name(value) : value);
    }
  }
  return text;
}

}  // namespace

std::span<const std::string_view> options_without_history() {
  static constexpr std::array<std::string_view, 15> others = {
      "--output",  "--plot",   "--annotate", "--threads", "--quiet",
      "--verbose", "--cache",  "--ros",      "--corners", "--kalibr",
      "--opencv",  "--report", "--json",     "--junit",   "--propose-gates"};
  return others;
}

HistoryEntry history_entry(const CLI::App& app, const std::vector<std::string>& inputs) {
  InputDigests digests;
  return history_of({app.get_name(), VLP_VERSION}, options_of(app, inputs),
                    {inputs.begin(), inputs.end()}, digests);
}

}  // namespace vlp
