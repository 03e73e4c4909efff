// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vlp {

/// A folder into which somebody puts images. It need not be there yet.
class WatchedFolder {
 public:
  explicit WatchedFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Changes {
    /// By name. An image that is overwritten comes again.
    std::vector<std::filesystem::path> came;
    std::vector<std::string> gone;
  };
  /// What changed since the last look. An image has come when it is the same file, of the same size
  /// and time, in two looks one after another: it is no longer written. Names that begin with a dot
  /// are not looked at: files in the making.
  Changes look();
  /// Of a file that is about to be removed: that it goes is no change.
  void forget(const std::string& name) { files_.erase(name); }

  const std::filesystem::path& folder() const { return folder_; }

 private:
  struct File {
    std::uintmax_t bytes;
    std::filesystem::file_time_type time;
    bool told;
  };
  std::filesystem::path folder_;
  std::map<std::string, File> files_;
};

}  // namespace vlp
