// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/yaml_parts.h"
#include "simulation/scene_parts.h"

namespace vlp {

Glow read_glow(YamlMap& map, const Room& room) {
  const YamlValue position = map.required("position_m");
  const Glow glow{read_point(position), map.required("diameter_m").number_within(1e-3, 10, "m"),
                  read_radiance(map, "radiance_e_per_s"), 0};
  const Eigen::Array3d at = glow.position_m.array();
  if ((at < room.min_m.array()).any() || (at > room.max_m.array()).any()) {
    throw position.error("is outside the room");
  }
  return glow;
}

double read_edge_share(YamlMap& map) {
  return map.required("edge_share").number_within(0, 2, "(of the radiance at the centre)");
}

std::vector<SceneLamp> read_scene_lamps(const YamlValue& list, const Room& room) {
  std::vector<SceneLamp> lamps;
  std::vector<Lamp> earlier;
  for (const YamlValue& item : list.list()) {
    YamlMap map = item.map();
    const Lamp lamp = read_lamp(map);
    check_lamp(earlier, lamp, item);
    earlier.push_back(lamp);
    SceneLamp read{lamp.id,
                   read_glow(map, room),
                   map.required("frequency_hz").number(),
                   map.required("duty").number(),
                   {},
                   Eigen::Vector3d::Zero()};
    read.glow.edge_share = read_edge_share(map);
    if (const auto phase = map.optional("phase")) {
      read.phase = phase->number_within(0, 1, "(of a period)");
    }
    if (const auto error = map.optional("map_error_m")) read.map_error_m = read_point(*error);
    map.finish();
    lamps.push_back(read);
  }
  return lamps;
}

}  // namespace vlp
