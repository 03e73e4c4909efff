// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/lamp_detector.h"

#include <cstdint>
#include <stdexcept>
#include <string>

#include "lamps/light_detector.h"

namespace vlp {
namespace {

std::string describe_image_size(const ImageSize& size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height);
}

/// Checks the layout of a view. @throws std::invalid_argument if the pixels are not readable with
/// this layout or the size differs
void check(const ImageView& image, const ImageSize& size) {
  if (image.data == nullptr) throw std::invalid_argument("the image has no pixels");
  if (image.size() != size) {
    throw std::invalid_argument("the image is " + describe_image_size(image.size()) +
                                ", the calibration's camera has " + describe_image_size(size) +
                                " px");
  }
  if (image.bits != 8 && image.bits != 16) {
    throw std::invalid_argument("pixels have " + std::to_string(image.bits) +
                                " bits, and should have 8 or 16");
  }
  const std::ptrdiff_t bytes = image.bits / 8;
  if (image.stride < image.width * bytes) {
    throw std::invalid_argument("the stride, " + std::to_string(image.stride) +
                                " bytes, is less than a row of the image");
  }
  if (image.stride % bytes != 0 ||
      reinterpret_cast<std::uintptr_t>(image.data) % static_cast<std::uintptr_t>(bytes) != 0) {
    throw std::invalid_argument("pixels of 16 bits are at odd addresses");
  }
}

}  // namespace

LampDetector::LampDetector(const LampMap& lamps, const Calibration& calibration)
    : size_{calibration.camera.imager_px[0], calibration.camera.imager_px[1]} {
  if (!calibration.camera.row_time_s) {
    throw std::invalid_argument(
        "the calibration has no row_time_s, which is needed to identify lamps");
  }
  detector_ = std::make_shared<const LightDetector>(lamps, make_detector_camera(calibration));
}

std::vector<Detection> LampDetector::detect_lamps(const ImageView& image) const {
  check(image, size_);
  return select_lamps(detector_->detect_lights(image));
}

std::vector<Detection> LampDetector::detect_lamps(
    const ImageView& image, const std::optional<Eigen::Matrix3d>& level_from_camera) const {
  check(image, size_);
  return select_lamps(detector_->copy_for_tilt(level_from_camera).detect_lights(image));
}

}  // namespace vlp
