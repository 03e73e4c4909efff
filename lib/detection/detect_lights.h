// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <vector>

#include "detection/lamp_detector.h"

namespace vlp {

/// All lights of an image, without their outlines.
struct ImageLights {
  std::filesystem::path file;
  cv::Size size;
  std::vector<Light> lights;
  /// Why the image could not be used, in one line; empty when it could.
  std::string refused;
};

/// The lights of each image, in their order, so many at a time. An image that cannot be used does
/// not end it. `progress` gets the images done so far; its calls do not overlap.
std::vector<ImageLights> detect_lights(const LampDetector& detector,
                                       std::span<const std::filesystem::path> images, int threads,
                                       const std::function<void(std::size_t done)>& progress);

}  // namespace vlp
