// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rig/yaml_reader.h"
#include "simulation/scene.h"

/// Descriptions of the parts of a scene file.
namespace vlp {

/// Axis-aligned bounds of the room: smallest and largest x, y, z in the world, m.
struct Room {
  Eigen::Vector3d min_m, max_m;
};

inline constexpr Range kPosition{-200, 200, "m"};
inline constexpr Range kElectronRate{0, 1e12, "electrons per second"};
inline constexpr DegreeRange kAzimuth{-360, 360};

/// Describe lamps, or other objects; lights are checked to be inside the room.
void describe_scene_lamps(YamlMap& io, std::vector<SceneLamp>& lamps, const Room& room);
void describe(YamlMap& io, Clutter& clutter, const std::vector<SceneLamp>& lamps, const Room& room);
/// Describes a capture set. Camera heights are checked to be below the lamps and inside the room.
void describe(YamlMap& io, CaptureSet& set, const Scene& scene, const Room& room);

}  // namespace vlp
