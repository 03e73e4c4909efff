// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace vlp {

/// The whole of a text file. Throws InputError when it cannot be read, is a folder, is empty, is
/// longer than `max_bytes`, holds control characters (a binary file), or when its last line has
/// no end: that is how a file cut short looks.
[[gnu::visibility("hidden")]] std::string read_text_file(const std::filesystem::path& path,
                                                         std::size_t max_bytes);

/// A file in the making that appears as a whole or not at all: a temporary file beside it, fsync,
/// rename. Whatever interrupts it, `path` holds the old content or the new. A symbolic link is
/// followed; a pipe or device is written to as it is. Killed, it may leave its temporary file,
/// ".NAME.tmp-PID-N", which nothing reads.
class WholeFile {
 public:
  /// Each throws InputError when the file cannot be written.
  [[gnu::visibility("hidden")]] explicit WholeFile(const std::filesystem::path& path);
  [[gnu::visibility("hidden")]] void write(std::string_view content);
  [[gnu::visibility("hidden")]] void save();
  /// Without waiting for the disk: a power cut may leave a part of it, and whoever reads it has to
  /// notice. For what can be made again.
  [[gnu::visibility("hidden")]] void save_unsynced();

  /// Without save() nothing has happened to `path`.
  [[gnu::visibility("hidden")]] ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

 private:
  std::filesystem::path path_, target_, temporary_;
  int descriptor_ = -1;
};

/// Replaces `path` by `content` as a whole (WholeFile). Throws InputError.
[[gnu::visibility("hidden")]] void write_file(const std::filesystem::path& path,
                                              std::string_view content);

}  // namespace vlp
