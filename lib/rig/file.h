// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace vlp {

/// A file that is read in blocks, or a stream that this process was given (/dev/stdin, /dev/fd/N).
class InputFile {
 public:
  /// Throws InputError if it cannot be opened, is a folder, another pipe or a device, or has more
  /// than `max_bytes`. Never waits for the writer of a pipe.
  [[gnu::visibility("hidden")]] InputFile(const std::filesystem::path& path, std::size_t max_bytes);
  [[gnu::visibility("hidden")]] ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Size of the file when it was opened; 0 for a stream.
  std::size_t bytes() const { return bytes_; }
  /// Reads up to `bytes` into `data` and returns how many; 0 at the end. Throws InputError if it
  /// cannot be read, or if there are more than `max_bytes` by now.
  [[gnu::visibility("hidden")]] std::size_t read(char* data, std::size_t bytes);

 private:
  std::filesystem::path path_;
  std::size_t max_bytes_, bytes_ = 0, read_bytes_ = 0;
  int descriptor_;
};

/// Reads the whole of a file. Throws InputError as InputFile.
[[gnu::visibility("hidden")]] std::string read_file(const std::filesystem::path& path,
                                                    std::size_t max_bytes);

/// Reads a text file by read_file(). Throws InputError also if it is empty, holds control
/// characters (a binary file), or if its last line has no end: it looks like a file cut short.
[[gnu::visibility("hidden")]] std::string read_text_file(const std::filesystem::path& path,
                                                         std::size_t max_bytes);

/// A file in the making that appears as a whole or not at all: a temporary file beside it, fsync,
/// rename. Whatever interrupts it, `path` holds the old content or the new. A file that is replaced
/// keeps its permissions, and its owner and group as far as this process may set them. A symbolic
/// link is followed. A pipe, a device or a stream of this process (/dev/stdout, /dev/fd/N) is
/// written to directly. Killed, it may leave its temporary file, ".NAME.tmp-PID-N", which nothing
/// reads.
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
