// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "program/steps/capture_options.h"

namespace vlp {

/// Estimates the rotation center from captures of a rotation in place
/// (calibration/rotation/find_rotation_captures.h), for vlp-rotation --method axis|joint|circle.
/// `plot` is the file of the plot; empty: none.
void run_rotation_in_place(const CLI::App& app, CaptureOptions images, const std::string& method,
                           const std::string& plot);

}  // namespace vlp
