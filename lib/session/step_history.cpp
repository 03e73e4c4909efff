// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/step_history.h"

#include <fmt/core.h>

#include "captures/digest.h"
#include "frontend/image_file.h"
#include "rig/input_error.h"

namespace vlp {

std::string last_component(const std::filesystem::path& path) {
  return std::filesystem::weakly_canonical(path).filename().string();
}

const std::string& InputDigests::digest_file(const std::filesystem::path& file) {
  const auto known = known_.find(file);
  return known != known_.end() ? known->second
                               : known_.emplace(file, hash_file(file)).first->second;
}

std::string InputDigests::digest_images(const std::filesystem::path& folder) {
  std::string digests;
  for (const auto& image : list_images(folder)) {
    digests += fmt::format("{}  {}\n", digest_file(image), image.filename().string());
  }
  return hash_text(digests);
}

std::string InputDigests::digest_folder(const std::filesystem::path& folder) {
  std::map<std::string, std::string> digests;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator entry(folder, error), end;
       !error && entry != end; entry.increment(error)) {
    std::error_code no_file;
    if (!entry->is_regular_file(no_file)) continue;
    std::string& digest = digests[entry->path().lexically_relative(folder).string()];
    try {
      digest = digest_file(entry->path());
    } catch (const InputError&) {
      digest = "cannot be read";
    }
  }
  std::string text;
  for (const auto& [name, digest] : digests) text += fmt::format("{}  {}\n", digest, name);
  return hash_text(text);
}

HistoryEntry make_history_entry(const ProgramVersion& program, const std::string& options,
                                const std::vector<std::filesystem::path>& inputs,
                                InputDigests& digests) {
  HistoryEntry entry{"", program.program, program.version, options, {}};
  for (const auto& input : inputs) {
    if (input.empty()) continue;
    entry.inputs.push_back({last_component(input), std::filesystem::is_directory(input)
                                                       ? digests.digest_images(input)
                                                       : digests.digest_file(input)});
  }
  return entry;
}

}  // namespace vlp
