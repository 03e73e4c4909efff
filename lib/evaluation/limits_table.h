// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "positioning/floor_limits.h"

namespace vlp {

/// Writes the achievable accuracy at each position of a floor as CSV. Columns:
///   x_m, y_m, z_m, yaw_rad, lamps, x_sd_m, y_sd_m, z_sd_m, yaw_sd_rad
///   for each source its horizontal standard deviation, named by its key and _m
///   horizontal_m, the standard deviation of all sources together
/// Cells of positions without a fix are empty.
/// @throws InputError if the file cannot be written
void write_floor_limits(const std::filesystem::path& file, const FloorLimits& limits);

}  // namespace vlp
