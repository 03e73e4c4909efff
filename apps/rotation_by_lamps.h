// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vlp {

/// The files of vlp-rotation --method lamps; `refined_map` is empty when the map stays.
struct LampsFiles {
  std::string captures, lamps, calibration, output, refined_map;
};

/// Levels the camera from captures taken anywhere (calibration/levelling.h).
void rotate_by_lamps(const CLI::App& app, const LampsFiles& files);

}  // namespace vlp
