// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "board.h"
#include "calibration.h"
#include "lamp_map.h"

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Format objects as YAML text: the content of the files of write_calibration(), write_board() and
/// write_lamp_map().
std::string format_calibration(const Calibration& calibration);
std::string format_board(const Board& board);
std::string format_lamp_map(const LampMap& map);

}  // namespace vlp
#pragma GCC visibility pop
