// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <unordered_set>

#include "board.h"
#include "calibration.h"
#include "lamp_map.h"
#include "yaml_reader.h"

// Not installed: nothing for the shared library to show.
#pragma GCC visibility push(hidden)
namespace vlp {

/// The parts that more than one kind of document holds. Each asks `map` for the keys that are the
/// fields of what it returns and leaves finish() to the caller, who may have keys of its own.
/// Throws InputError.
Lamp read_lamp(YamlMap& map);
/// Its size is unknown if it is a disc without diameter_m.
LampShape read_shape(YamlMap& map);
Board read_board(YamlMap& map);
Camera read_camera(YamlMap& map);

/// Writes the keys that read_shape() reads.
void emit_shape(YAML::Emitter& out, const LampShape& shape);

/// Lamps that were read so far, by id and place.
class EarlierLamps {
 public:
  /// Throws InputError at `item` if an earlier lamp has the id or the place of this one.
  void check(const Lamp& lamp, const YamlValue& item) const;
  void add(const Lamp& lamp);

 private:
  std::unordered_set<int> ids_;
  /// By x in metres.
  std::multimap<double, Lamp> lamps_;
};

}  // namespace vlp
#pragma GCC visibility pop
