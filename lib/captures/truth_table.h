// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// A row of `truth.csv`: where the camera (or the robot's centre) was, in the world.
struct TruthRow {
  std::string image;
  Eigen::Vector2d xy_m;
  std::optional<double> z_m, yaw_rad;
  /// Where the row stands in the file.
  std::size_t line = 0;
};

/// Reads image, x_m, y_m and, optionally, z_m and yaw_rad, fields of which may be empty. Throws
/// InputError: see CsvTable; a place further off than kFarthest_m; an image name that is empty; an
/// image twice; no rows.
std::vector<TruthRow> read_truth(const std::filesystem::path& file);

}  // namespace vlp
