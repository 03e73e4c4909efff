// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rig/calibration.h"

namespace CLI {
class App;
}

namespace vlp {

/// The options that do not change what is recorded: --output, other outputs, a cache, what is
/// shown.
std::span<const std::string_view> options_without_history();

/// How a part came to be, but for the part's name (rig/stage.h): program and version, the options
/// that were given, in the order of --help, and a digest of each input, a file or a folder of
/// images; an empty name is an input that was not given. The same on every machine: of files and
/// folders only the last name is kept, and options_without_history() are left out. Call it
/// after parsing. Throws InputError.
HistoryEntry history_entry(const CLI::App& app, const std::vector<std::string>& inputs);

}  // namespace vlp
