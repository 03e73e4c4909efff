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
  Reflection reflection{read_glow(map, room, read_rectangle(map)),
                        std::size_t(lamp - lamps.begin())};
  reflection.glow.edge_share = 0;
  map.finish();
  return reflection;
}

Panel read_panel(YamlMap map) {
  Panel panel;
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
  panel.radiance_e_per_s = read_radiance(map, "radiance_e_per_s");
  map.finish();
  return panel;
}

/// What is drawn as hiding every light has to be below every light.
void check_occluder(const YamlValue& item, const Panel& occluder, double lowest_light_m) {
  const double highest_m = occluder.corner_m.z() + std::max(0.0, occluder.edge_a_m.z()) +
                           std::max(0.0, occluder.edge_b_m.z());
  if (highest_m < lowest_light_m) return;
  throw item.error("is not below every lamp, steady lamp, window and reflection");
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
  double lowest_m = std::numeric_limits<double>::infinity();
  const auto see = [&](double height_m) { lowest_m = std::min(lowest_m, height_m); };
  for (const SceneLamp& lamp : lamps) see(lamp.glow.position_m.z());
  for (const Glow& lamp : clutter.steady_lamps) see(lamp.position_m.z());
  for (const Reflection& reflection : clutter.reflections) see(reflection.glow.position_m.z());
  for (const Panel& window : clutter.windows) {
    see(window.corner_m.z() + std::min(0.0, window.edge_a_m.z()) +
        std::min(0.0, window.edge_b_m.z()));
  }
  for (const YamlValue& item : items(map, "occluders")) {
    clutter.occluders.push_back(read_panel(item.map()));
    check_occluder(item, clutter.occluders.back(), lowest_m);
  }
  map.finish();
  return clutter;
}

}  // namespace vlp
