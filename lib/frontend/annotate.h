// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "lamps/shape/light.h"
#include "rig/calibration.h"

namespace vlp {

/// A picture of what was found, to look at: the image, brightened, with the outline points of each
/// light, its centre, what it is, and why it is no lamp. Lamps are green, cut ones yellow, unknown
/// lights red, steady ones blue,
/// formless ones grey. `image` has one channel of 8 or 16 bits.
cv::Mat annotated(const cv::Mat& image, const std::vector<Light>& lights, Readout readout);

/// Writes it as PNG into `folder`, whole or not at all, named like the image with `.png` added.
/// Throws InputError.
void write_annotated(const std::filesystem::path& folder, const std::filesystem::path& image_file,
                     const cv::Mat& picture);

}  // namespace vlp
