// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <unordered_set>

#include "board.h"
#include "calibration.h"
#include "lamp_map.h"
#include "yaml_reader.h"

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Readers of the parts that several kinds of documents contain. Each reads the keys of `map` that
/// are the fields of its result. The caller reads its own keys and calls
/// check_all_keys_read(). All throw InputError if a value is invalid.
Lamp read_lamp_from_yaml(YamlMap& map);
/// Reads the shape of a lamp (kind, axis lengths in m, yaw in rad) from the keys of a lamp. The
/// size is std::nullopt for a disc without diameter_m.
/// @throws InputError if a value is invalid
LampShape read_lamp_shape_from_yaml(YamlMap& map);
Board read_board_from_yaml(YamlMap& map);
Camera read_camera_from_yaml(YamlMap& map);

/// Writes the keys of a shape to the current YAML map, as read by read_lamp_shape_from_yaml().
void emit_yaml_lamp_shape(YAML::Emitter& out, const LampShape& shape);

/// Index of the lamps that were already read from a file, to find duplicates by id and position.
class UniqueLamps {
 public:
  /// Throws InputError at the lamp's mapping if an added lamp has the same id or is within 1 mm.
  void check_unique(const Lamp& lamp, const YamlMap& map) const;
  void add(const Lamp& lamp);

 private:
  std::unordered_set<int> ids_;
  /// Lamps by x in meters.
  std::multimap<double, Lamp> lamps_;
};

}  // namespace vlp
#pragma GCC visibility pop
