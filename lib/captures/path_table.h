// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

namespace vlp {

/// A polyline in the world: two waypoints or more, from each straight on to the next.
struct Path {
  std::vector<Eigen::Vector2d> waypoints_m;
  /// Their heights: as many as waypoints, or none.
  std::vector<double> z_m;
};

/// The point of a path that is nearest to a place, seen from above.
struct NearestOnPath {
  Eigen::Vector2d xy_m;
  /// In between the waypoints', in proportion; nothing when the path has no heights.
  std::optional<double> z_m;
};

NearestOnPath nearest_on(const Path& path, const Eigen::Vector2d& place_m);

/// Reads x_m, y_m and, optionally, z_m. Throws InputError: see CsvTable; a waypoint further off
/// than kFarthest_m; fewer than two, or all at one place.
Path read_path(const std::filesystem::path& file);

}  // namespace vlp
