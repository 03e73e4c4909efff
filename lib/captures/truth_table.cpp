// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/truth_table.h"

#include <algorithm>
#include <limits>

#include "captures/csv_reader.h"

namespace vlp {

std::vector<TruthRow> read_truth_table(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto image = csv.require_column("image");
  const auto x_m = csv.require_column("x_m"), y_m = csv.require_column("y_m");
  const auto z_m = csv.find_column("z_m"), yaw_rad = csv.find_column("yaw_rad");
  NameIndex images(csv.num_rows());
  std::vector<TruthRow> rows;
  rows.reserve(csv.num_rows());
  for (std::size_t row = 0; row < csv.num_rows(); ++row) {
    const auto name = read_unique_name(csv, row, image, images);
    TruthRow& read = rows.emplace_back();
    read.image = name;
    read.xy_m = {csv.get_coordinate_m(row, x_m), csv.get_coordinate_m(row, y_m)};
    if (z_m && !csv.get_cell_text(row, *z_m).empty()) read.z_m = csv.get_coordinate_m(row, *z_m);
    read.yaw_rad = csv.get_optional_number(row, yaw_rad);
    read.line = csv.line_number_of_row(row);
  }
  if (rows.empty()) throw InputError(file, "contains no position");
  return rows;
}

PathPoint project_onto_path(const Path& path, const Eigen::Vector2d& position_m) {
  PathPoint nearest{path.waypoints_m.front(), {}};
  double min_squared_distance = std::numeric_limits<double>::infinity();
  std::size_t leg = 0;
  double leg_fraction = 0;
  for (std::size_t i = 0; i + 1 < path.waypoints_m.size(); ++i) {
    const Eigen::Vector2d& begin = path.waypoints_m[i];
    const Eigen::Vector2d along = path.waypoints_m[i + 1] - begin, to_place = position_m - begin;
    const double squared_length = along.squaredNorm();
    const double fraction =
        squared_length > 0 ? std::clamp(to_place.dot(along) / squared_length, 0.0, 1.0) : 0;
    const double squared_distance = (fraction * along - to_place).squaredNorm();
    if (squared_distance >= min_squared_distance) continue;
    min_squared_distance = squared_distance;
    leg = i;
    leg_fraction = fraction;
    nearest.xy_m = begin + fraction * along;
  }
  if (!path.z_m.empty()) {
    nearest.z_m = path.z_m[leg] + leg_fraction * (path.z_m[leg + 1] - path.z_m[leg]);
  }
  return nearest;
}

Path read_path_table(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto x_m = csv.require_column("x_m"), y_m = csv.require_column("y_m");
  const auto z_m = csv.find_column("z_m");
  Path path;
  for (std::size_t row = 0; row < csv.num_rows(); ++row) {
    path.waypoints_m.emplace_back(csv.get_coordinate_m(row, x_m), csv.get_coordinate_m(row, y_m));
    if (z_m) path.z_m.push_back(csv.get_coordinate_m(row, *z_m));
  }
  const bool leads_somewhere =
      std::any_of(path.waypoints_m.begin(), path.waypoints_m.end(),
                  [&](const auto& waypoint) { return waypoint != path.waypoints_m.front(); });
  if (!leads_somewhere)
    throw InputError(file, "needs two or more waypoints at different positions");
  return path;
}

}  // namespace vlp
