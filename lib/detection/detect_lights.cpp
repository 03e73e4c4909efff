// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_lights.h"

#include "detection/images_in_parallel.h"

namespace vlp {

std::vector<ImageLights> detect_lights(const LightDetector& detector,
                                       std::span<const std::filesystem::path> images,
                                       const std::optional<std::array<int, 2>>& imager_px,
                                       int threads,
                                       const std::function<void(std::size_t done)>& progress) {
  std::vector<ImageLights> found(images.size());
  images_in_parallel(
      images.size(), threads,
      [&](std::size_t i) {
        found[i] = detect_image(detector, SourceImage(images[i]), imager_px);
        found[i].image.release();
        for (Light& light : found[i].lights) light.outline = {};
      },
      progress);
  return found;
}

}  // namespace vlp
