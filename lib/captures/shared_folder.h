// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "captures/id.h"

namespace vlp {

/// Folder that others can write to, such as the captures, results and spool of a station. Its files
/// are accessed from the open folder by names without a path, and symbolic links are not followed.
/// Therefore no file outside the folder is read, written or removed. All functions throw
/// InputError.
class SharedFolder {
 public:
  /// Opens an existing folder. Symbolic links in `path` are followed, because the user specified
  /// it.
  /// @throws InputError if the folder does not exist or cannot be opened
  explicit SharedFolder(const std::filesystem::path& path);
  SharedFolder(SharedFolder&& other) noexcept;
  SharedFolder& operator=(SharedFolder&&) = delete;
  ~SharedFolder();

  const std::filesystem::path& folder_path() const { return path_; }
  /// Checks that the path of a folder, made or found in another one, still leads to it, and not by
  /// a link.
  void check_not_replaced() const;

  /// Opens a subfolder. Returns std::nullopt if it does not exist.
  std::optional<SharedFolder> open_if_exists(const Id& name) const;
  /// Opens a subfolder, and creates it first if it does not exist.
  SharedFolder open_or_create(const Id& name) const;

  /// Returns true if an entry of this name exists, including a symbolic link.
  bool contains(const std::string& name) const;
  /// Reads a regular file. Returns std::nullopt if it does not exist. Throws if it is a link, a
  /// pipe or a device, or longer than `max_bytes`.
  std::optional<std::string> read_if_exists(const std::string& name, std::size_t max_bytes) const;
  /// Replaces or creates a file atomically: a temporary file, fsync, rename. Mode and owner of a
  /// replaced regular file are kept. A link is replaced and not followed.
  void replace_file(const std::string& name, std::string_view content) const;
  /// Opens a regular file with the flags of open(2). Returns -1 if it cannot be opened; throws if
  /// it is a link, a pipe or a device.
  int open_regular_file(const std::string& name, int flags) const;
  /// Renames a file within the folder. Returns false if it does not exist.
  bool rename_file(const std::string& from, const std::string& to) const;
  /// Removes a file if it exists.
  void remove_file(const std::string& name) const;
  /// Removes all entries of the folder, including its folders. Of a link, only the link is removed.
  void remove_all() const;
  /// Removes an empty subfolder.
  void remove_subfolder(const Id& name) const;

 private:
  SharedFolder(std::filesystem::path path, int descriptor);
  std::filesystem::path require_entry_path(const std::string& name) const;
  /// Returns a path of the open folder, whose name may refer to another one by now.
  std::filesystem::path descriptor_path() const;

  std::filesystem::path path_;
  int descriptor_;
};

/// Checks that a JSON text from an untrusted source has at most 16 levels and a million values.
/// Call it before parsing: a parser needs 100 bytes for a value of two bytes of text. Values in
/// strings do not count. Throws std::runtime_error with the bound that is exceeded.
void check_json_limits(std::string_view text);

}  // namespace vlp
