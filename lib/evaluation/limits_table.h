// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "evaluation/errors/floor_limits.h"

namespace vlp {

/// Writes the predicted standard deviations of fixes (error budget) at each position of a floor as
/// CSV, one row per position. Columns:
///   x_m, y_m, z_m, yaw_rad        pose of the camera in the world
///   lamps                         number of fully visible lamps
///   x_sd_m, y_sd_m, z_sd_m, yaw_sd_rad
///                                 standard deviations from all sources together
///   KEY_m                         for each source its horizontal standard deviation, by its key
///   horizontal_m                  horizontal standard deviation from all sources together
/// Standard deviations of positions without a fix are empty.
/// @throws InputError if the file cannot be written
void write_floor_limits(const std::filesystem::path& file, const FloorLimits& limits);

}  // namespace vlp
