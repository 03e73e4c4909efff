// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/watched_folder.h"

#include "frontend/image_folder.h"

namespace vlp {

namespace fs = std::filesystem;

WatchedFolder::Changes WatchedFolder::poll_changes() {
  std::map<std::string, File> now;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with('.') || !is_image_name(entry->path())) continue;
    std::error_code gone;  // the file was removed
    const bool file = entry->is_regular_file(gone);
    const File found{entry->file_size(gone), entry->last_write_time(gone), false};
    if (file && !gone && found.bytes > 0) now.emplace(name, found);
  }
  Changes changes;
  for (auto& [name, file] : now) {
    const auto before = files_.find(name);
    if (before == files_.end()) continue;
    const bool same = before->second.bytes == file.bytes && before->second.time == file.time;
    if (same && !before->second.is_reported) changes.added.push_back(folder_ / name);
    file.is_reported = same;
  }
  for (const auto& [name, file] : files_) {
    if (!now.contains(name)) changes.gone.push_back(name);
  }
  files_ = std::move(now);
  return changes;
}

}  // namespace vlp
