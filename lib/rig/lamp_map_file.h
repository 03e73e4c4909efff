// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lamp_map.h"

namespace vlp {

/// Lamp map with its file and the room of each lamp.
struct LampMapFile {
  std::filesystem::path file;
  LampMap map;
  /// Name of the room of each lamp, in the order of map.lamps. An element is empty if the file
  /// states no room for the lamp.
  std::vector<std::string> rooms;
};

/// Reads the lamps of read_lamps_of_room() and the name of the room of each lamp. Throws
/// InputError.
LampMapFile read_lamps_and_rooms(const std::filesystem::path& file, const std::string& room);

/// Reads a map as read_lamps_of_room() does, for a purpose that needs lamps above the camera.
/// @throws InputError also if the map states lamps_below_camera
LampMap read_overhead_lamps(const std::filesystem::path& file, const std::string& room);

}  // namespace vlp
