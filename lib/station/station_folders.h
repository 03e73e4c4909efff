// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "captures/shared_folder.h"

namespace vlp {

/// Makes a folder of a station unless it is there. Throws InputError.
void make_folder(const std::filesystem::path& folder);

/// Checks before a unit is begun that a file can be written into a folder, and that there is room
/// for so many bytes. Throws InputError.
void check_room(const SharedFolder& folder, std::uintmax_t bytes);

}  // namespace vlp
