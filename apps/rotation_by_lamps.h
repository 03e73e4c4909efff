// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "capture_options.h"

namespace vlp {

/// vlp-rotation --method lamps: levels the camera from captures taken anywhere
/// (calibration/levelling.h). `refined_map` is empty when the lamp map stays.
void rotate_by_lamps(const CLI::App& app, const CaptureOptions& images,
                     const std::string& refined_map);

}  // namespace vlp
