// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vlp {

/// Folder in which images arrive. It need not exist yet.
class WatchedFolder {
 public:
  explicit WatchedFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Changes {
    /// New images, by name. An overwritten image is new again.
    std::vector<std::filesystem::path> added;
    std::vector<std::string> gone;
  };
  /// Returns the changes since the last call. An image is new if file, size and time are the same
  /// in two successive calls, so that it is no longer being written. Ignores names that begin with
  /// a dot, which are incomplete files.
  Changes poll_changes();
  /// Ignores the removal of a file that the caller is about to delete.
  void forget(const std::string& name) { files_.erase(name); }

  const std::filesystem::path& folder() const { return folder_; }

 private:
  struct File {
    std::uintmax_t bytes;
    std::filesystem::file_time_type time;
    bool is_reported;
  };
  std::filesystem::path folder_;
  std::map<std::string, File> files_;
};

}  // namespace vlp
