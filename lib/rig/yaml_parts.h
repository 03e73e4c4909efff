// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// Refuses a lamp that has the id or the place of an earlier one.
void check_lamp(const std::vector<Lamp>& earlier, const Lamp& lamp, const YamlValue& item);

}  // namespace vlp
#pragma GCC visibility pop
