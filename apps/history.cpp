// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "history.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "detection/image_file.h"

namespace vlp {
namespace {

/// Without the folders, which are another on each machine; "." has a name, too.
std::string last_name(const std::string& path) {
  const std::filesystem::path whole = std::filesystem::weakly_canonical(path);
  return whole.filename().string();
}

bool changes_the_result(const CLI::Option& option) {
  constexpr std::array<std::string_view, 13> others = {
      "--output", "--plot",   "--annotate", "--threads", "--quiet", "--verbose", "--cache",
      "--ros",    "--kalibr", "--opencv",   "--report",  "--json",  "--junit"};
  return std::find(others.begin(), others.end(), option.get_name()) == others.end();
}

/// Its value is the name of a file that is written.
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

std::string sha256_of_images(const std::filesystem::path& folder) {
  std::string lines;
  for (const auto& image : images_in(folder)) {
    lines += fmt::format("{}  {}\n", sha256_of_file(image), image.filename().string());
  }
  return sha256_of_text(lines);
}

HistoryEntry history_entry(const CLI::App& app, const std::vector<std::string>& inputs) {
  HistoryEntry entry{"", app.get_name(), VLP_VERSION, options_of(app, inputs), {}};
  for (const std::string& input : inputs) {
    if (input.empty()) continue;
    entry.inputs.push_back({last_name(input), std::filesystem::is_directory(input)
                                                  ? sha256_of_images(input)
                                                  : sha256_of_file(input)});
  }
  return entry;
}

}  // namespace vlp
