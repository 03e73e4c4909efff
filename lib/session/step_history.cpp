// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/step_history.h"

#include <fmt/core.h>

#include "captures/digest.h"
#include "frontend/image_file.h"
#include "rig/input_error.h"

namespace vlp {

std::string last_path_component(const std::filesystem::path& path) {
  return std::filesystem::weakly_canonical(path).filename().string();
}

const std::string& InputDigests::compute_file_digest(const std::filesystem::path& file) {
  const auto known = known_.find(file);
  return known != known_.end() ? known->second
                               : known_.emplace(file, compute_file_sha256(file)).first->second;
}

std::string InputDigests::compute_image_folder_digest(const std::filesystem::path& folder) {
  std::string digests;
  for (const auto& image : list_images(folder)) {
    digests += fmt::format("{}  {}\n", compute_file_digest(image), image.filename().string());
  }
  return compute_text_sha256(digests);
}

std::string InputDigests::compute_folder_digest(const std::filesystem::path& folder) {
  std::map<std::string, std::string> digests;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator entry(folder, error), end;
       !error && entry != end; entry.increment(error)) {
    std::error_code no_file;
    if (!entry->is_regular_file(no_file)) continue;
    std::string& digest = digests[entry->path().lexically_relative(folder).string()];
    try {
      digest = compute_file_digest(entry->path());
    } catch (const InputError&) {
      digest = "cannot be read";
    }
  }
  std::string text;
  for (const auto& [name, digest] : digests) text += fmt::format("{}  {}\n", digest, name);
  return compute_text_sha256(text);
}

HistoryEntry make_calibration_history_entry(const ProgramVersion& program,
                                            const std::string& options,
                                            const std::vector<std::filesystem::path>& inputs,
                                            InputDigests& digests) {
  HistoryEntry entry{"", program.program, program.version, options, {}};
  for (const auto& input : inputs) {
    if (input.empty()) continue;
    entry.inputs.push_back(
        {last_path_component(input), std::filesystem::is_directory(input)
                                         ? digests.compute_image_folder_digest(input)
                                         : digests.compute_file_digest(input)});
  }
  return entry;
}

}  // namespace vlp
