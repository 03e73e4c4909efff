// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "geometry/angles.h"
#include "rig/yaml_parts.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

double read_fraction(YamlMap& map, const std::string& key) {
  return map.get_required_yaml_value(key).read_yaml_number_within(0, 1,
                                                                  "(of the source's radiance)");
}

DarkSide read_dark_side(YamlMap& map) {
  return {read_fraction(map, "reflector_ratio"),
          rad_from_deg(map.get_required_yaml_value("azimuth_deg")
                           .read_yaml_number_within(-360, 360, "degrees"))};
}

Recess read_recess(YamlMap& map, const Glow& rim) {
  Recess recess;
  recess.depth_m = map.get_required_yaml_value("depth_m").read_yaml_number_within(0, 2, "m");
  const YamlValue source = map.get_required_yaml_value("source_diameter_m");
  recess.source_diameter_m = source.read_yaml_number_within(1e-3, 10, "m");
  if (recess.source_diameter_m > 2 * rim.glow_radius_m()) {
    throw source.make_yaml_error("is larger than the rim, diameter_m");
  }
  recess.reflector_ratio = read_fraction(map, "reflector_ratio");
  recess.dark_side = map.convert_optional_yaml_mapping("dark_side", read_dark_side);
  recess.source_power =
      map.get_optional_yaml_number("source_power", 0.5, 30, "").value_or(recess.source_power);
  recess.rim_power =
      map.get_optional_yaml_number("rim_power", 0, 30, "").value_or(recess.rim_power);
  recess.beam_power =
      map.get_optional_yaml_number("beam_power", 0, 30, "").value_or(recess.beam_power);
  recess.far_side_slope = map.get_optional_yaml_number("far_side_slope", 0.01, 100,
                                                       "(meters sideways for each meter up)");
  return recess;
}

Chips read_chips(YamlMap& map, const Glow& disc) {
  Chips chips;
  chips.fraction = read_fraction(map, "fraction");
  const YamlValue pitch = map.get_required_yaml_value("pitch_m");
  chips.pitch_m = pitch.read_yaml_number_within(1e-3, 10, "m");
  if (chips.pitch_m > 2 * disc.glow_radius_m())
    throw pitch.make_yaml_error("is larger than the disc, diameter_m");
  const YamlValue width = map.get_required_yaml_value("width_m");
  chips.width_m = width.read_yaml_number_within(1e-4, 10, "m");
  if (chips.width_m > 2 * chips.pitch_m) {
    throw width.make_yaml_error("is more than twice pitch_m: such chips are an even disc");
  }
  return chips;
}

RandomChips read_random_chips(YamlMap& map) {
  RandomChips chips;
  chips.count = map.get_required_yaml_value("count").read_yaml_integer_within(1, 1000);
  chips.sigma_fraction = map.get_required_yaml_value("sigma_fraction")
                             .read_yaml_number_within(0.01, 1, "(of the disc's radius)");
  chips.within_fraction = map.get_required_yaml_value("within_fraction")
                              .read_yaml_number_within(0, 1, "(of the disc's radius)");
  std::tie(chips.min_excess, chips.max_excess) =
      read_yaml_range(map.get_required_yaml_value("excess"), 0, 10, "(of the disc's radiance)");
  return chips;
}

Halo read_halo(YamlMap& map) {
  return {read_fraction(map, "fraction"),
          map.get_required_yaml_value("length_m").read_yaml_number_within(1e-3, 2, "m")};
}

/// Reads the keys of a glow except those of read_radial_profile().
Glow read_glow(YamlMap& map, const Room& room) {
  const YamlValue position = map.get_required_yaml_value("position_m");
  Glow glow{read_yaml_point(position), read_lamp_shape_from_yaml(map), 0, 1};
  if (!glow.shape.size_m) map.get_required_yaml_value("diameter_m");
  glow.electron_rate_e_per_s = read_yaml_electron_rate(map, "electron_rate_e_per_s");
  const Eigen::Array3d at = glow.position_m.array();
  if ((at < room.min_m.array()).any() || (at > room.max_m.array()).any()) {
    throw position.make_yaml_error("is outside the room");
  }
  return glow;
}

/// Reads the brightness profile of a disc: recess or rim_to_center_ratio, and halo. Other shapes
/// are evenly bright.
void read_radial_profile(YamlMap& map, Glow& glow) {
  if (glow.shape.kind != ShapeKind::disc) return;
  glow.recess = map.convert_optional_yaml_mapping(
      "recess", [&](YamlMap& keys) { return read_recess(keys, glow); });
  if (!glow.recess) {
    glow.rim_to_center_ratio =
        map.get_required_yaml_value("rim_to_center_ratio")
            .read_yaml_number_within(0, 2, "(of the radiance at the center)");
    glow.chips = map.convert_optional_yaml_mapping(
        "chips", [&](YamlMap& keys) { return read_chips(keys, glow); });
    if (const auto chips = map.get_optional_yaml_value("random_chips")) {
      if (glow.chips)
        throw chips->make_yaml_error("excludes chips: a disc has one of them; leave one out");
      glow.random_chips = chips->convert_yaml_mapping(read_random_chips);
    }
  }
  glow.halo = map.convert_optional_yaml_mapping("halo", read_halo);
}

Glow read_steady_lamp(YamlMap& map, const Room& room) {
  Glow glow = read_glow(map, room);
  read_radial_profile(map, glow);
  return glow;
}

Reflection read_reflection(YamlMap& map, const std::vector<SceneLamp>& lamps, const Room& room) {
  const YamlValue id = map.get_required_yaml_value("of_lamp");
  const int wanted = id.read_yaml_integer_within(0, std::numeric_limits<int>::max());
  const auto lamp = std::ranges::find(lamps, wanted, &SceneLamp::id);
  if (lamp == lamps.end()) throw id.make_yaml_error("there is no lamp " + std::to_string(wanted));
  Reflection reflection{read_glow(map, room), std::size_t(lamp - lamps.begin())};
  reflection.glow.rim_to_center_ratio = 0;
  return reflection;
}

/// Reads a panel's corner and edges.
Panel read_panel_edges(YamlMap& map) {
  Panel panel{};
  panel.corner_m = read_yaml_point(map.get_required_yaml_value("corner_m"));
  const YamlValue edges = map.get_required_yaml_value("edges_m");
  const auto list = edges.read_yaml_list();
  if (list.size() != 2)
    throw edges.make_yaml_error("should be two vectors, from the corner along each edge");
  panel.edge_a_m = read_yaml_point(list[0]);
  panel.edge_b_m = read_yaml_point(list[1]);
  const double lengths = panel.edge_a_m.norm() * panel.edge_b_m.norm();
  constexpr double right_angle = 1e-6;
  if (!(lengths > 0) || std::abs(panel.edge_a_m.dot(panel.edge_b_m)) > right_angle * lengths) {
    throw edges.make_yaml_error("should be at right angles to each other and not of length zero");
  }
  return panel;
}

Panel read_panel(YamlMap& map) {
  Panel panel = read_panel_edges(map);
  panel.electron_rate_e_per_s = read_yaml_electron_rate(map, "electron_rate_e_per_s");
  return panel;
}

RectifiedSine read_mains(YamlMap& map) {
  return {map.get_required_yaml_value("frequency_hz").read_yaml_number_within(10, 1000, "Hz"),
          map.get_required_yaml_value("depth").read_yaml_number_within(0, 1, "(of the light)"), 0};
}

SquareWave read_pwm(YamlMap& map) {
  return {map.get_required_yaml_value("frequency_hz").read_yaml_number_within(1, 1e6, "Hz"),
          map.get_required_yaml_value("duty").read_yaml_number_within(1e-3, 1, "(of a period)"), 0};
}

ForeignLight read_foreign_light(YamlMap& map, const Room& room) {
  ForeignLight light{read_steady_lamp(map, room), {}, {}};
  const auto pwm = map.get_optional_yaml_value("pwm"), mains = map.get_optional_yaml_value("mains");
  if (pwm.has_value() == mains.has_value())
    throw map.make_yaml_error("needs one of the keys pwm and mains");
  if (pwm) {
    light.wave = pwm->convert_yaml_mapping(read_pwm);
  } else {
    light.wave = mains->convert_yaml_mapping(read_mains);
  }
  light.phase = map.get_optional_yaml_number("phase", 0, 1, "(of a period)");
  return light;
}

Mirror read_mirror(YamlMap& map) {
  return {
      read_panel_edges(map),
      map.get_required_yaml_value("reflectance").read_yaml_number_within(0, 1, "(of the light)")};
}

Blind read_venetian_blind(YamlMap& map) {
  return {read_panel(map), map.get_required_yaml_value("slats").read_yaml_integer_within(1, 1000),
          map.get_required_yaml_value("open_fraction")
              .read_yaml_number_within(0, 1, "(of a slat's pitch)")};
}

Sign read_sign(YamlMap& map) {
  return {read_panel(map),
          map.get_required_yaml_value("lines").read_yaml_integer_within(1, 100),
          map.get_required_yaml_value("letters").read_yaml_integer_within(1, 100),
          {}};
}

/// Returns the height of the lowest light, m. Mirror images do not count.
double find_lowest_light_m(const std::vector<SceneLamp>& lamps, const Clutter& clutter) {
  double lowest_m = std::numeric_limits<double>::infinity();
  const auto include_glow = [&](const Glow& glow) {
    lowest_m = std::min(lowest_m, glow.position_m.z());
  };
  const auto include_panel = [&](const Panel& panel) {
    lowest_m = std::min(lowest_m, panel.corner_m.z() + std::min(0.0, panel.edge_a_m.z()) +
                                      std::min(0.0, panel.edge_b_m.z()));
  };
  for (const SceneLamp& lamp : lamps) include_glow(lamp.glow);
  for (const Glow& lamp : clutter.steady_lamps) include_glow(lamp);
  for (const Reflection& reflection : clutter.reflections) include_glow(reflection.glow);
  for (const ForeignLight& light : clutter.foreign_lights) include_glow(light.glow);
  for (const Panel& window : clutter.windows) include_panel(window);
  for (const Blind& blind : clutter.blinds) include_panel(blind.window);
  for (const Sign& sign : clutter.signs) include_panel(sign.panel);
  return lowest_m;
}

/// Rejects an occluder that is not below every light, since it is rendered as hiding all lights.
void check_occluder(const YamlValue& item, const Panel& occluder, double lowest_light_m) {
  const double highest_m = occluder.corner_m.z() + std::max(0.0, occluder.edge_a_m.z()) +
                           std::max(0.0, occluder.edge_b_m.z());
  if (highest_m < lowest_light_m) return;
  throw item.make_yaml_error("is not below every lamp and other light");
}

SceneLamp read_scene_lamp(YamlMap& map, const Lamp& lamp, const Room& room) {
  SceneLamp read{lamp.id,
                 read_glow(map, room),
                 map.get_required_yaml_value("frequency_hz").read_yaml_number(),
                 map.get_required_yaml_value("duty").read_yaml_number(),
                 {},
                 Eigen::Vector3d::Zero()};
  read_radial_profile(map, read.glow);
  read.phase = map.get_optional_yaml_number("phase", 0, 1, "(of a period)");
  if (const auto error = map.get_optional_yaml_value("map_error_m"))
    read.map_error_m = read_yaml_point(*error);
  return read;
}

}  // namespace

std::vector<SceneLamp> read_scene_lamps(const YamlValue& list, const Room& room) {
  std::vector<SceneLamp> lamps;
  UniqueLamps earlier;
  for (const YamlValue& item : list.read_yaml_list()) {
    lamps.push_back(item.convert_yaml_mapping([&](YamlMap& map) {
      const Lamp lamp = read_lamp_from_yaml(map);
      earlier.check_lamp_id_and_position_unique(lamp, item);
      earlier.register_lamp_id_and_position(lamp);
      return read_scene_lamp(map, lamp, room);
    }));
  }
  return lamps;
}

Clutter read_scene_clutter(YamlMap& map, const std::vector<SceneLamp>& lamps, const Room& room) {
  Clutter clutter;
  clutter.steady_lamps = map.convert_yaml_mapping_list_or_empty(
      "steady_lamps", [&](YamlMap& keys) { return read_steady_lamp(keys, room); });
  clutter.windows = map.convert_yaml_mapping_list_or_empty("windows", read_panel);
  clutter.reflections = map.convert_yaml_mapping_list_or_empty(
      "reflections", [&](YamlMap& keys) { return read_reflection(keys, lamps, room); });
  clutter.foreign_lights = map.convert_yaml_mapping_list_or_empty(
      "foreign_lights", [&](YamlMap& keys) { return read_foreign_light(keys, room); });
  clutter.mirrors = map.convert_yaml_mapping_list_or_empty("mirrors", read_mirror);
  clutter.blinds = map.convert_yaml_mapping_list_or_empty("blinds", read_venetian_blind);
  clutter.signs = map.convert_yaml_mapping_list_or_empty("signs", read_sign);
  clutter.ambient_flicker = map.convert_optional_yaml_mapping("ambient_flicker", read_mains);
  const double lowest_m = find_lowest_light_m(lamps, clutter);
  if (const auto occluders = map.get_optional_yaml_value("occluders")) {
    for (const YamlValue& item : occluders->read_yaml_list()) {
      clutter.occluders.push_back(item.convert_yaml_mapping(read_panel));
      check_occluder(item, clutter.occluders.back(), lowest_m);
    }
  }
  return clutter;
}

}  // namespace vlp
