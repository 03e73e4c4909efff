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
  /// Number of the row's line in the file, from 1; 0 if the row was not read from a file.
  std::size_t line = 0;
};

/// Reads `truth.csv`. Columns: image, x_m, y_m and, optionally, z_m and yaw_rad, whose fields may
/// be empty.
/// @throws InputError as CsvTable; if a coordinate exceeds kMaxCoordinate_m; if an image name is
/// empty or occurs twice; if there are no rows
std::vector<TruthRow> read_truth_table(const std::filesystem::path& file);

/// A polyline in the world with at least two waypoints.
struct Path {
  std::vector<Eigen::Vector2d> waypoints_m;
  /// Heights of the waypoints; empty if unknown.
  std::vector<double> z_m;
};

/// Point of a path closest to a position, horizontally.
struct PathPoint {
  Eigen::Vector2d xy_m;
  /// Height interpolated between the waypoints; std::nullopt if the path has no heights.
  std::optional<double> z_m;
};

/// Returns the point of a path closest to a position.
PathPoint project_onto_path(const Path& path, const Eigen::Vector2d& position_m);

/// Reads a path. Columns: x_m, y_m and, optionally, z_m.
/// @throws InputError as CsvTable; if a coordinate exceeds kMaxCoordinate_m; if there are fewer
/// than two waypoints, or all coincide
Path read_path_table(const std::filesystem::path& file);

}  // namespace vlp
