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

/// A row of `truth.csv`: ground-truth position of the camera (or the robot's center) in the world.
struct TruthRow {
  std::string image;
  Eigen::Vector2d xy_m;
  std::optional<double> z_m, yaw_rad;
  /// Line of the row in the file.
  std::size_t line = 0;
};

/// Reads `truth.csv`. Columns: image, x_m, y_m and, optionally, z_m and yaw_rad, whose fields may
/// be empty.
/// @throws InputError as CsvTable; if a coordinate exceeds kMaxCoordinate_m; if an image name is
/// empty or occurs twice; if there are no rows
std::vector<TruthRow> read_truth(const std::filesystem::path& file);

}  // namespace vlp
