// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "lamps/shape/light.h"
#include "rig/calibration.h"

namespace vlp {

/// Renders the detected lights into a brightened color copy of an image, for visual inspection.
/// Draws outline points, center, kind and reason of each light. Lamps are green, truncated lights
/// yellow, unknown ones red, unmodulated ones blue, and lights without outline gray.
///
/// @param image  one channel of 8 or 16 bits
cv::Mat render_annotated(const cv::Mat& image, const std::vector<Light>& lights, Readout readout);

/// Writes an annotated image atomically as PNG into `folder`, named like the image with `.png`
/// appended.
/// @throws InputError if the file cannot be written
void write_annotated(const std::filesystem::path& folder, const std::filesystem::path& image_file,
                     const cv::Mat& picture);

}  // namespace vlp
