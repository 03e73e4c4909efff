// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "positioning/floor_limits.h"

namespace vlp {

/// Writes what each place of a floor allows as CSV: x_m, y_m, z_m, yaw_rad, lamps, sd_x_m, sd_y_m,
/// sd_z_m, sd_yaw_rad; of each source its horizontal standard deviation, under its key and _m;
/// horizontal_m of all together. What a place does not determine is empty. Throws InputError.
void write_limits(const std::filesystem::path& file, const FloorLimits& limits);

}  // namespace vlp
