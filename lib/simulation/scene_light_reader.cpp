// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <tuple>

#include "geometry/angles.h"
#include "rig/yaml_parts.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

double read_fraction(YamlMap& map, const std::string& key) {
  return map.required(key).number_within(0, 1, "(of the source's radiance)");
}

Recess read_recess(YamlMap map, const Glow& rim) {
  Recess recess;
  recess.depth_m = map.required("depth_m").number_within(0, 2, "m");
  const YamlValue source = map.required("source_diameter_m");
  recess.source_diameter_m = source.number_within(1e-3, 10, "m");
  if (recess.source_diameter_m > 2 * rim.radius_m()) {
    throw source.error("is larger than the rim, diameter_m");
  }
  recess.reflector_ratio = read_fraction(map, "reflector_ratio");
  if (const auto dark = map.optional("dark_side")) {
    YamlMap keys = dark->map();
    recess.dark_side =
        DarkSide{read_fraction(keys, "reflector_ratio"),
                 rad_from_deg(keys.required("azimuth_deg").number_within(-360, 360, "degrees"))};
    keys.finish();
  }
  const auto read_power = [&](const std::string& key, double min_power, double& power) {
    if (const auto value = map.optional(key)) power = value->number_within(min_power, 30, "");
  };
  read_power("source_power", 0.5, recess.source_power);
  read_power("rim_power", 0, recess.rim_power);
  read_power("beam_power", 0, recess.beam_power);
  if (const auto slope = map.optional("far_side_slope")) {
    recess.far_side_slope = slope->number_within(0.01, 100, "(meters sideways for each meter up)");
  }
  map.finish();
  return recess;
}

Chips read_chips(YamlMap map, const Glow& disc) {
  Chips chips;
  chips.fraction = read_fraction(map, "fraction");
  const YamlValue pitch = map.required("pitch_m");
  chips.pitch_m = pitch.number_within(1e-3, 10, "m");
  if (chips.pitch_m > 2 * disc.radius_m()) throw pitch.error("is larger than the disc, diameter_m");
  const YamlValue width = map.required("width_m");
  chips.width_m = width.number_within(1e-4, 10, "m");
  if (chips.width_m > 2 * chips.pitch_m) {
    throw width.error("is more than twice pitch_m: such chips are an even disc");
  }
  map.finish();
  return chips;
}

RandomChips read_random_chips(YamlMap map) {
  RandomChips chips;
  chips.count = map.required("count").integer_within(1, 1000);
  chips.sigma_fraction =
      map.required("sigma_fraction").number_within(0.01, 1, "(of the disc's radius)");
  chips.within_fraction =
      map.required("within_fraction").number_within(0, 1, "(of the disc's radius)");
  std::tie(chips.min_excess, chips.max_excess) =
      read_range(map.required("excess"), 0, 10, "(of the disc's radiance)");
  map.finish();
  return chips;
}

}  // namespace

Glow read_glow(YamlMap& map, const Room& room) {
  const YamlValue position = map.required("position_m");
  Glow glow{read_point(position), read_shape(map), 0, 1};
  if (!glow.shape.size_m) map.required("diameter_m");
  glow.electron_rate_e_per_s = read_radiance(map, "electron_rate_e_per_s");
  const Eigen::Array3d at = glow.position_m.array();
  if ((at < room.min_m.array()).any() || (at > room.max_m.array()).any()) {
    throw position.error("is outside the room");
  }
  return glow;
}

void read_profile(YamlMap& map, Glow& glow) {
  if (glow.shape.kind != ShapeKind::disc) return;
  if (const auto recess = map.optional("recess")) {
    glow.recess = read_recess(recess->map(), glow);
  } else {
    glow.rim_to_center_ratio =
        map.required("rim_to_center_ratio").number_within(0, 2, "(of the radiance at the center)");
    if (const auto chips = map.optional("chips")) glow.chips = read_chips(chips->map(), glow);
    if (const auto chips = map.optional("random_chips")) {
      if (glow.chips) throw chips->error("stands beside chips: a disc has one of them");
      glow.random_chips = read_random_chips(chips->map());
    }
  }
  if (const auto halo = map.optional("halo")) {
    YamlMap keys = halo->map();
    glow.halo = Halo{read_fraction(keys, "fraction"),
                     keys.required("length_m").number_within(1e-3, 2, "m")};
    keys.finish();
  }
}

std::vector<SceneLamp> read_scene_lamps(const YamlValue& list, const Room& room) {
  std::vector<SceneLamp> lamps;
  UniqueLamps earlier;
  for (const YamlValue& item : list.list()) {
    YamlMap map = item.map();
    const Lamp lamp = read_lamp(map);
    earlier.check(lamp, item);
    earlier.add(lamp);
    SceneLamp read{lamp.id,
                   read_glow(map, room),
                   map.required("frequency_hz").number(),
                   map.required("duty").number(),
                   {},
                   Eigen::Vector3d::Zero()};
    read_profile(map, read.glow);
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
