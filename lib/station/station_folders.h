// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

namespace vlp {

/// Makes a folder of a station unless it is there. Throws InputError.
void make_folder(const std::filesystem::path& folder);

/// That a folder is there, or can be, takes a file, and has room for so much: what is asked before
/// a unit is begun. Throws InputError.
void check_room(const std::filesystem::path& folder, std::uintmax_t bytes);

}  // namespace vlp
