// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "captures/digest.h"
#include "rig/calibration.h"

namespace vlp {

/// Of a folder of images: what `sha256sum *.png | sha256sum` says there, the images being those
/// that images_in() finds, in its order. Throws InputError.
std::string sha256_of_images(const std::filesystem::path& folder);

/// How a part came to be, but for the part's name (rig/stage.h): program and version, the options
/// that were given, in the order of --help, and a digest of each input, a file or a folder of
/// images; an empty name is an input that was not given. The same on every machine: of files and
/// folders only the last name is kept, and what does not change the result (--output, --plot,
/// --annotate, --threads, --quiet, --verbose, other outputs, a cache) is left out. Call it after
/// parsing. Throws InputError.
HistoryEntry history_entry(const CLI::App& app, const std::vector<std::string>& inputs);

}  // namespace vlp
