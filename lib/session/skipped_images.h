// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rig/input_error.h"
#include "session/step_result.h"

namespace vlp {

/// Lines "FILE: why" of images that were refused, by their names, with their folders where there
/// are several. A line of another form keeps its
/// words.
std::vector<SkippedImage> skipped_images(const std::vector<std::filesystem::path>& images,
                                         const std::vector<std::string>& refused);

/// That none of so many images can be used, with the reason of the first.
InputError nothing_usable(const std::filesystem::path& where, std::size_t images,
                          const StepResult& result);

}  // namespace vlp
