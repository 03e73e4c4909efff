// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace vlp {

/// File that is read in blocks, or a stream that this process was given (/dev/stdin, /dev/fd/N).
class InputFile {
 public:
  /// Opens a file for reading. Does not wait if `path` is a pipe without a writer.
  /// @param max_bytes  largest accepted size in bytes
  /// @throws InputError if the file cannot be opened or has more than `max_bytes`; also if it is a
  ///     folder, a device or a pipe other than this process's streams
  [[gnu::visibility("hidden")]] InputFile(const std::filesystem::path& path, std::size_t max_bytes);
  /// Takes an open regular file, whose descriptor it closes. `path` is its name in messages.
  [[gnu::visibility("hidden")]] InputFile(const std::filesystem::path& path, int descriptor,
                                          std::size_t max_bytes);
  [[gnu::visibility("hidden")]] ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Returns the size of the file when it was opened; 0 for a stream.
  std::size_t file_size_bytes() const { return bytes_; }
  /// Reads up to `bytes` into `data` and returns the number read; 0 at the end. Throws InputError
  /// if it cannot be read, or if the total exceeds `max_bytes`.
  [[gnu::visibility("hidden")]] std::size_t read(char* data, std::size_t bytes);

 private:
  std::filesystem::path path_;
  std::size_t max_bytes_, bytes_ = 0, read_bytes_ = 0;
  int descriptor_;
};

/// Returns the content of a file. Throws InputError as InputFile.
[[gnu::visibility("hidden")]] std::string read_file(const std::filesystem::path& path,
                                                    std::size_t max_bytes);

/// Returns the content of an open file from the current position to the end.
[[gnu::visibility("hidden")]] std::string read_file(InputFile& file);

/// Reads a text file by read_file(). Throws InputError also if it is empty or has control
/// characters (a binary file), or if the last line has no end (a truncated file).
[[gnu::visibility("hidden")]] std::string read_text_file(const std::filesystem::path& path,
                                                         std::size_t max_bytes);

/// Atomic file writer: a temporary file in the same folder, fsync, rename. After any interruption
/// `path` has the old content or the new.
///
/// A replaced file keeps its permissions, and its owner and group as far as this process may set
/// them. Symbolic links are followed. A pipe, a device or a stream of this process (/dev/stdout,
/// /dev/fd/N) is written directly. A killed process may leave its temporary file, ".NAME.tmp-N",
/// which no program reads and the next writer of the file removes.
class AtomicFileWriter {
 public:
  /// Creates the temporary file. This and the next functions throw InputError if the file cannot be
  /// written.
  [[gnu::visibility("hidden")]] explicit AtomicFileWriter(const std::filesystem::path& path);
  /// Creates the temporary file in a folder that others can write to. A link of the name is
  /// replaced and not followed. `shown` is the path in messages.
  [[gnu::visibility("hidden")]] AtomicFileWriter(const std::filesystem::path& folder,
                                                 const std::string& name,
                                                 const std::filesystem::path& shown);
  [[gnu::visibility("hidden")]] void write(std::string_view content);
  /// Flushes the content to disk and renames the file to `path`.
  [[gnu::visibility("hidden")]] void save_file();
  /// Saves without waiting for the disk, for content that can be produced again. After a power
  /// failure the file may be truncated, which its reader must detect.
  [[gnu::visibility("hidden")]] void save_without_fsync();

  /// Removes the temporary file. Without save_file() or save_without_fsync(), `path` is unchanged.
  [[gnu::visibility("hidden")]] ~AtomicFileWriter();
  AtomicFileWriter(const AtomicFileWriter&) = delete;
  AtomicFileWriter& operator=(const AtomicFileWriter&) = delete;

 private:
  std::filesystem::path path_, target_, temporary_;
  int descriptor_ = -1;
};

/// Replaces `path` by `content` atomically (AtomicFileWriter). Throws InputError.
[[gnu::visibility("hidden")]] void write_file(const std::filesystem::path& path,
                                              std::string_view content);

/// Sets the permissions (read, write, execute), owner and group of an open file to those of the
/// file that it replaces; owner and group as far as this process may set them. If the group
/// differs, it gets no permissions. Returns false, and sets errno, if they cannot be read or set.
[[gnu::visibility("hidden")]] bool copy_owner(int descriptor, const struct stat& former);

}  // namespace vlp
