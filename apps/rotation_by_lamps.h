// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "detect_folder.h"

namespace vlp {

/// vlp-rotation --method lamps: levels the camera from captures taken anywhere
/// (calibration/levelling.h). `refined_map` is empty when the lamp map stays.
void rotate_by_lamps(const CLI::App& app, const DetectOptions& detect,
                     const std::string& refined_map);

}  // namespace vlp
