// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/floor_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "camera/lens.h"

namespace vlp {
namespace {

bool in_image(const Lens& lens, const Camera& camera, const Pose& pose,
              const Eigen::Vector3d& x_in_world) {
  const auto pixel = lens.project(level_from_world(pose, x_in_world));
  return pixel && pixel->minCoeff() >= -0.5 && pixel->x() <= camera.imager_px[0] - 0.5 &&
         pixel->y() <= camera.imager_px[1] - 0.5;
}

bool seen_whole(const Lens& lens, const Camera& camera, const Pose& pose, const Lamp& lamp) {
  if (lamp.position_m.z() <= pose.position_m.z()) return false;
  if (!in_image(lens, camera, pose, lamp.position_m)) return false;
  constexpr int rim_points = 16;
  const double radius_m = lamp.diameter_m.value_or(0) / 2;
  for (int i = 0; i < rim_points && radius_m > 0; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / rim_points;
    const Eigen::Vector3d rim(std::cos(angle_rad), std::sin(angle_rad), 0);
    if (!in_image(lens, camera, pose, lamp.position_m + radius_m * rim)) return false;
  }
  return true;
}

std::vector<Eigen::Vector3d> visible_lamps(const LampMap& map, const Camera& camera,
                                           const Lens& lens, const Pose& pose) {
  std::vector<Eigen::Vector3d> visible;
  for (const Lamp& lamp : map.lamps) {
    if (seen_whole(lens, camera, pose, lamp)) visible.push_back(lamp.position_m);
  }
  return visible;
}

int places_along(double min_m, double max_m, double step_m) {
  constexpr double most = 1e7, rounding = 1e-9;
  const double places = std::floor((max_m - min_m) / step_m + rounding) + 1;
  if (!(step_m > 0) || !(places >= 1)) {
    throw std::invalid_argument(
        "the floor should have x_min <= x_max, y_min <= y_max and a positive step");
  }
  if (!(places <= most))
    throw std::invalid_argument("the floor has more than ten million places: take a larger step");
  return static_cast<int>(places);
}

}  // namespace

FloorGrid floor_under(const LampMap& map, double step_m) {
  const Eigen::Vector3d& first = map.lamps.front().position_m;
  FloorGrid grid{first.x(), first.x(), first.y(), first.y(), step_m};
  for (const Lamp& lamp : map.lamps) {
    grid.x_min_m = std::min(grid.x_min_m, lamp.position_m.x());
    grid.x_max_m = std::max(grid.x_max_m, lamp.position_m.x());
    grid.y_min_m = std::min(grid.y_min_m, lamp.position_m.y());
    grid.y_max_m = std::max(grid.y_max_m, lamp.position_m.y());
  }
  return grid;
}

std::vector<Eigen::Vector3d> visible_lamps(const LampMap& map, const Camera& camera,
                                           const Pose& pose) {
  return visible_lamps(map, camera, Lens(camera.lens_model, camera.intrinsics), pose);
}

std::vector<FloorLimit> floor_limits(const LampMap& map, const Camera& camera,
                                     const FloorGrid& grid, double z_m, double yaw_rad,
                                     const ErrorSources& sources) {
  const Lens lens(camera.lens_model, camera.intrinsics);
  const int columns = places_along(grid.x_min_m, grid.x_max_m, grid.step_m);
  const int rows = places_along(grid.y_min_m, grid.y_max_m, grid.step_m);
  if (double{1} * columns * rows > 1e7) {
    throw std::invalid_argument("the floor has more than ten million places: take a larger step");
  }
  std::vector<FloorLimit> limits;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Pose pose{{grid.x_min_m + column * grid.step_m, grid.y_min_m + row * grid.step_m, z_m},
                      yaw_rad};
      const auto lamps = visible_lamps(map, camera, lens, pose);
      limits.push_back(
          {pose, static_cast<int>(lamps.size()), error_budget(lamps, lens, pose, sources)});
    }
  }
  return limits;
}

}  // namespace vlp
