// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_image.h"

#include <algorithm>
#include <exception>

#include "rig/input_error.h"

namespace vlp {
namespace {

cv::Mat image_of_size(const std::filesystem::path& file,
                      const std::optional<std::array<int, 2>>& imager_px, double max_mpx) {
  cv::Mat image = read_image(file, max_mpx);
  if (imager_px && (image.cols != (*imager_px)[0] || image.rows != (*imager_px)[1])) {
    throw InputError(file, "is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) +
                               ", the calibration's camera has " + std::to_string((*imager_px)[0]) +
                               " x " + std::to_string((*imager_px)[1]) + " px");
  }
  return image;
}

}  // namespace

ImageLights detect_image(const LampDetector& detector, const std::filesystem::path& file,
                         const std::optional<std::array<int, 2>>& imager_px, double max_mpx) {
  ImageLights result{file, {}, {}, {}, {}};
  try {
    result.image = image_of_size(file, imager_px, max_mpx);
    result.size = result.image.size();
    result.lights = detector.detect(result.image);
  } catch (const InputError& error) {
    result.refused = error.what();
  } catch (const std::exception& error) {
    result.refused = file.string() + ": cannot be used: " + error.what();
    std::replace(result.refused.begin(), result.refused.end(), '\n', ' ');
  }
  return result;
}

}  // namespace vlp
