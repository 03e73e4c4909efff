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

/// Bounds of the room in the world.
struct Room {
  Eigen::Vector3d min_m, max_m;
};

/// Largest number of captures of one folder.
inline constexpr int kMaxCaptures = 1'000'000;

Eigen::Vector3d read_point(const YamlValue& value);
double read_radiance(YamlMap& map, const std::string& key);
/// Reads two ascending numbers [least, most] within min and max.
std::pair<double, double> read_range(const YamlValue& value, double min, double max,
                                     std::string_view unit);
/// Rejects more than kMaxCaptures captures. `where` provides error() for the message.
template <typename Place>
void check_count(double captures, const Place& where) {
  if (captures <= kMaxCaptures) return;
  throw where.error("makes more than " + std::to_string(kMaxCaptures) + " captures");
}

/// Read lamps, or other objects; lights are checked to be inside the room.
std::vector<SceneLamp> read_scene_lamps(const YamlValue& list, const Room& room);
Clutter read_clutter(YamlMap map, const std::vector<SceneLamp>& lamps, const Room& room);
/// Reads the keys of a glow except those of read_profile().
Glow read_glow(YamlMap& map, const Room& room);
/// Reads the brightness profile of a disc: recess or rim_to_center_ratio, and halo. Other shapes
/// are evenly bright.
void read_profile(YamlMap& map, Glow& glow);
ImageProcessing read_image_processing(YamlMap map, const Sensor& sensor);
SceneBoard read_scene_board(YamlMap map);
ArchiveVariation read_archive_variation(YamlMap map);
/// Reads the position of the rotation axis at each capture: spots, a grid or a drive, all inside
/// the room.
void read_places(YamlMap& map, const Scene& scene, const Room& room, LampShots& captures);
/// Reads a capture set. Camera heights are checked to be below the lamps and inside the room.
CaptureSet read_capture_set(YamlMap map, const Scene& scene, const Room& room);

}  // namespace vlp
