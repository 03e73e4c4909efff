// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "rig/yaml_parts.h"
#include "simulation/scene_parts.h"

namespace vlp {
namespace {

Glow read_steady_lamp(YamlMap map, const Room& room) {
  Glow glow = read_glow(map, room);
  read_profile(map, glow);
  map.finish();
  return glow;
}

Reflection read_reflection(YamlMap map, const std::vector<SceneLamp>& lamps, const Room& room) {
  const YamlValue id = map.required("of_lamp");
  const int wanted = id.integer_within(0, std::numeric_limits<int>::max());
  const auto lamp = std::find_if(lamps.begin(), lamps.end(),
                                 [&](const SceneLamp& each) { return each.id == wanted; });
  if (lamp == lamps.end()) throw id.error("there is no lamp " + std::to_string(wanted));
  Reflection reflection{read_glow(map, room), std::size_t(lamp - lamps.begin())};
  reflection.glow.rim_to_center_ratio = 0;
  map.finish();
  return reflection;
}

/// Reads a panel's corner and edges.
Panel read_place(YamlMap& map) {
  Panel panel{};
  panel.corner_m = read_point(map.required("corner_m"));
  const YamlValue edges = map.required("edges_m");
  const auto list = edges.list();
  if (list.size() != 2) throw edges.error("should be two vectors, from the corner along each edge");
  panel.edge_a_m = read_point(list[0]);
  panel.edge_b_m = read_point(list[1]);
  const double lengths = panel.edge_a_m.norm() * panel.edge_b_m.norm();
  constexpr double right_angle = 1e-6;
  if (!(lengths > 0) || std::abs(panel.edge_a_m.dot(panel.edge_b_m)) > right_angle * lengths) {
    throw edges.error("should be at right angles to each other and not of length zero");
  }
  return panel;
}

/// Reads a panel with its radiance; further keys of the map may follow.
Panel read_lit_panel(YamlMap& map) {
  Panel panel = read_place(map);
  panel.electron_rate_e_per_s = read_radiance(map, "electron_rate_e_per_s");
  return panel;
}

Panel read_panel(YamlMap map) {
  const Panel panel = read_lit_panel(map);
  map.finish();
  return panel;
}

RectifiedSine read_mains(YamlMap map) {
  const RectifiedSine mains{map.required("frequency_hz").number_within(10, 1000, "Hz"),
                            map.required("depth").number_within(0, 1, "(of the light)"), 0};
  map.finish();
  return mains;
}

SquareWave read_pwm(YamlMap map) {
  const SquareWave pwm{map.required("frequency_hz").number_within(1, 1e6, "Hz"),
                       map.required("duty").number_within(1e-3, 1, "(of a period)"), 0};
  map.finish();
  return pwm;
}

ForeignLight read_foreign_light(YamlMap map, const Room& room) {
  ForeignLight light{read_glow(map, room), {}, {}};
  read_profile(map, light.glow);
  const auto pwm = map.optional("pwm"), mains = map.optional("mains");
  if (pwm.has_value() == mains.has_value()) throw map.error("needs one of the keys pwm and mains");
  if (pwm) {
    light.wave = read_pwm(pwm->map());
  } else {
    light.wave = read_mains(mains->map());
  }
  if (const auto phase = map.optional("phase")) {
    light.phase = phase->number_within(0, 1, "(of a period)");
  }
  map.finish();
  return light;
}

Mirror read_mirror(YamlMap map) {
  const Mirror mirror{read_place(map),
                      map.required("reflectance").number_within(0, 1, "(of the light)")};
  map.finish();
  return mirror;
}

Blind read_blind(YamlMap map) {
  const Blind blind{read_lit_panel(map), map.required("slats").integer_within(1, 1000),
                    map.required("open_fraction").number_within(0, 1, "(of a slat's pitch)")};
  map.finish();
  return blind;
}

Sign read_sign(YamlMap map) {
  const Sign sign{read_lit_panel(map),
                  map.required("lines").integer_within(1, 100),
                  map.required("letters").integer_within(1, 100),
                  {}};
  map.finish();
  return sign;
}

/// Returns the height of the lowest light, m. Mirror images do not count.
double find_lowest_light_m(const std::vector<SceneLamp>& lamps, const Clutter& clutter) {
  double lowest_m = std::numeric_limits<double>::infinity();
  const auto include_height = [&](double height_m) { lowest_m = std::min(lowest_m, height_m); };
  const auto include_panel = [&](const Panel& panel) {
    include_height(panel.corner_m.z() + std::min(0.0, panel.edge_a_m.z()) +
                   std::min(0.0, panel.edge_b_m.z()));
  };
  for (const SceneLamp& lamp : lamps) include_height(lamp.glow.position_m.z());
  for (const Glow& lamp : clutter.steady_lamps) include_height(lamp.position_m.z());
  for (const Reflection& reflection : clutter.reflections)
    include_height(reflection.glow.position_m.z());
  for (const ForeignLight& light : clutter.foreign_lights)
    include_height(light.glow.position_m.z());
  for (const Panel& window : clutter.windows) include_panel(window);
  for (const Blind& blind : clutter.blinds) include_panel(blind.window);
  for (const Sign& sign : clutter.signs) include_panel(sign.panel);
  return lowest_m;
}

/// Rejects an occluder that is not below every light, since it is rendered as hiding all lights.
void check_occluder(const YamlValue& item, const Panel& occluder, double find_lowest_light_m) {
  const double highest_m = occluder.corner_m.z() + std::max(0.0, occluder.edge_a_m.z()) +
                           std::max(0.0, occluder.edge_b_m.z());
  if (highest_m < find_lowest_light_m) return;
  throw item.error("is not below every lamp and other light");
}

std::vector<YamlValue> items(YamlMap& map, const std::string& key) {
  const auto value = map.optional(key);
  return value ? value->list() : std::vector<YamlValue>();
}

}  // namespace

Clutter read_clutter(YamlMap map, const std::vector<SceneLamp>& lamps, const Room& room) {
  Clutter clutter;
  for (const YamlValue& item : items(map, "steady_lamps")) {
    clutter.steady_lamps.push_back(read_steady_lamp(item.map(), room));
  }
  for (const YamlValue& item : items(map, "windows")) {
    clutter.windows.push_back(read_panel(item.map()));
  }
  for (const YamlValue& item : items(map, "reflections")) {
    clutter.reflections.push_back(read_reflection(item.map(), lamps, room));
  }
  for (const YamlValue& item : items(map, "foreign_lights")) {
    clutter.foreign_lights.push_back(read_foreign_light(item.map(), room));
  }
  for (const YamlValue& item : items(map, "mirrors")) {
    clutter.mirrors.push_back(read_mirror(item.map()));
  }
  for (const YamlValue& item : items(map, "blinds")) {
    clutter.blinds.push_back(read_blind(item.map()));
  }
  for (const YamlValue& item : items(map, "signs")) {
    clutter.signs.push_back(read_sign(item.map()));
  }
  if (const auto flicker = map.optional("ambient_flicker")) {
    clutter.ambient_flicker = read_mains(flicker->map());
  }
  const double lowest_m = find_lowest_light_m(lamps, clutter);
  for (const YamlValue& item : items(map, "occluders")) {
    clutter.occluders.push_back(read_panel(item.map()));
    check_occluder(item, clutter.occluders.back(), lowest_m);
  }
  map.finish();
  return clutter;
}

}  // namespace vlp
