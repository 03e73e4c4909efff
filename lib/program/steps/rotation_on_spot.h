// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "program/steps/capture_options.h"

namespace vlp {

/// vlp-rotation --method axis|joint|circle: captures of a turn on the spot
/// (calibration/rotation/spot_captures.h). `plot` is empty when there is to be no picture.
void rotate_on_spot(const CLI::App& app, CaptureOptions images, const std::string& method,
                    const std::string& plot);

}  // namespace vlp
