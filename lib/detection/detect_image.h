// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "detection/image_source.h"
#include "lamps/light_detector.h"

namespace vlp {

/// An image and its lights.
struct ImageLights {
  std::filesystem::path file;
  cv::Mat image;
  cv::Size size;
  std::vector<Light> lights;
  /// Why the image could not be used, in one line; empty when it could.
  std::string refused;
  /// Read-out with which the lights were detected.
  Readout readout;
};

/// Detects the lights of an image. One bad image does not end a run, whatever is bad about it: it
/// cannot be read, or has another size than `imager_px`, or more than so many million pixels. With
/// `any_readout` the image may be read out the other way than the detector has it, see
/// detect_either_way().
ImageLights detect_image(const LightDetector& detector, const SourceImage& source,
                         const std::optional<std::array<int, 2>>& imager_px = std::nullopt,
                         double max_mpx = kUsualMaxMpx, bool any_readout = false);

}  // namespace vlp
