// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/lamps_in_view.h"

#include <algorithm>

namespace vlp {

std::vector<std::size_t> find_lamps_in_view(const LampMap& map, const Lens& lens,
                                            const std::array<int, 2>& imager_px,
                                            const Eigen::Matrix3d& camera_from_level,
                                            const Pose& level) {
  const auto in_image = [&](const Eigen::Vector3d& x_in_world) {
    const auto pixel = lens.project(camera_from_level * level_from_world(level, x_in_world));
    return pixel && pixel->minCoeff() >= -0.5 && pixel->x() <= imager_px[0] - 0.5 &&
           pixel->y() <= imager_px[1] - 0.5;
  };
  const auto seen_whole = [&](const Lamp& lamp) {
    if (lamp.position_m.z() <= level.position_m.z()) return false;
    if (!in_image(lamp.position_m)) return false;
    const auto outline_m = outline_of(lamp.shape, lamp.position_m);
    return std::all_of(outline_m.begin(), outline_m.end(), in_image);
  };
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    if (seen_whole(map.lamps[i])) seen.push_back(i);
  }
  return seen;
}

}  // namespace vlp
