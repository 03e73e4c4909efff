// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "captures/shared_folder.h"

namespace vlp {

/// Creates a folder of a station if it does not exist. Throws InputError.
void create_station_folder(const std::filesystem::path& folder);

/// Checks, before a unit is started, that a folder is writable and has `bytes` bytes of free space.
/// @throws InputError if it is not writable or has less space
void require_space(const SharedFolder& folder, std::uintmax_t bytes);

}  // namespace vlp
