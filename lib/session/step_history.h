// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "rig/calibration.h"

namespace vlp {

/// Name and version of the program that makes a part of a calibration, for its history.
struct ProgramVersion {
  std::string program, version;
};

/// Cache of SHA-256 digests of input files and folders, in hexadecimal digits. Each file is read
/// only once.
class InputDigests {
 public:
  /// Returns the digest of a file's content. Throws InputError if the file cannot be read.
  const std::string& digest_file(const std::filesystem::path& file);
  /// Returns the digest of the images in a folder: that of a text with a line "SHA-256  NAME" per
  /// image, by name. Throws InputError if an image cannot be read.
  std::string digest_images(const std::filesystem::path& folder);
  /// Returns the digest of all files in a folder and its subfolders, in the form of
  /// digest_images(). A file that cannot be read enters as "cannot be read".
  std::string digest_folder(const std::filesystem::path& folder);

 private:
  std::map<std::filesystem::path, std::string> known_;
};

/// Returns an entry for the history, without the part's name. `inputs` are files and folders of
/// images; an empty name is an input that was not given. Stores only the last component of each
/// path, because folders differ between machines. Throws InputError if an input cannot be read.
HistoryEntry make_history_entry(const ProgramVersion& program, const std::string& options,
                                const std::vector<std::filesystem::path>& inputs,
                                InputDigests& digests);

/// Returns the last component of a path, also for ".".
std::string last_component(const std::filesystem::path& path);

}  // namespace vlp
