// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "rig/calibration.h"

namespace vlp {

/// Who makes a part of a calibration, for its history.
struct ProgramVersion {
  std::string program, version;
};

/// SHA-256 of files and folders, each file read once.
class InputDigests {
 public:
  /// Of a file's content. Throws InputError.
  const std::string& of_file(const std::filesystem::path& file);
  /// Of the images in a folder: of a line "SHA-256  NAME" for each, by name. Throws InputError.
  std::string of_images(const std::filesystem::path& folder);
  /// Of everything in a folder, likewise; a file that cannot be read counts as that.
  std::string of_all(const std::filesystem::path& folder);

 private:
  std::map<std::filesystem::path, std::string> known_;
};

/// An entry for the history: inputs are files and folders of images, an empty name is an input that
/// was not given; they stand there without their folders, which are another on each machine. Throws
/// InputError.
HistoryEntry history_of(const ProgramVersion& program, const std::string& options,
                        const std::vector<std::filesystem::path>& inputs, InputDigests& digests);

/// A file's or folder's name without its folders; "." has one, too.
std::string last_name(const std::filesystem::path& path);

}  // namespace vlp
