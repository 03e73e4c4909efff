// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "detection/detect_image.h"

namespace vlp {

/// The lights of each image, of that size when it is stated, in their order, so many at a time,
/// without pixels and outlines. An image that cannot be used does not end it. `progress` gets the
/// images done so far; its calls do not overlap.
std::vector<ImageLights> detect_lights(const LightDetector& detector,
                                       std::span<const std::filesystem::path> images,
                                       const std::optional<std::array<int, 2>>& imager_px,
                                       int threads,
                                       const std::function<void(std::size_t done)>& progress);

}  // namespace vlp
