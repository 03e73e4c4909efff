// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rig/yaml_reader.h"
#include "simulation/scene.h"

/// Readers of the parts of a scene file. Each throws InputError.
namespace vlp {

/// Axis-aligned bounds of the room: smallest and largest x, y, z in the world, m.
struct Room {
  Eigen::Vector3d min_m, max_m;
};

Eigen::Vector3d read_yaml_point(const YamlValue& value);
double read_yaml_electron_rate(YamlMap& map, const std::string& key);
/// Reads a list of two ascending numbers [min, max]. Throws InputError if one of them is outside
/// `min` to `max`.
std::pair<double, double> read_yaml_range(const YamlValue& value, double min, double max,
                                          std::string_view unit);
/// Read lamps, or other objects; lights are checked to be inside the room.
std::vector<SceneLamp> read_scene_lamps(const YamlValue& list, const Room& room);
Clutter read_scene_clutter(YamlMap& map, const std::vector<SceneLamp>& lamps, const Room& room);
/// Reads a capture set. Camera heights are checked to be below the lamps and inside the room.
CaptureSet read_scene_capture_set(YamlMap& map, const Scene& scene, const Room& room);

}  // namespace vlp
