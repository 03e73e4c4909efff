// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "evaluation/metric.h"

namespace vlp {

/// Measures levels of the camera's signal in images of a board: `board_white`. Levels are fractions
/// of full scale, medians over at most 12 images. Images that cannot be read are ignored.
std::vector<Metric> measure_board_levels(const std::vector<std::filesystem::path>& images);

/// Measures levels in images of lamps (`lamp_white`, `dark_level`) as measure_board_levels() does,
/// and counts defective pixels (`defective_pixels`) in these and in images of the board:
///
///   hot   at least 4 % of full scale brighter than the median of the 3 x 3 pixels about it in each
///         image of lamps
///   dark  at least 25 % darker than this median in each image of the board in which the median
///         exceeds 20 % of full scale, and in three or more
///
/// The images differ in their contents, so that defects of the sensor are common to them.
std::vector<Metric> measure_sensor(const std::vector<std::filesystem::path>& lamps,
                                   const std::vector<std::filesystem::path>& boards);

}  // namespace vlp
