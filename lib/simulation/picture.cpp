// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vlp {

double white_dn(const Sensor& sensor) { return sensor.bits == 8 ? 255 : 65535; }

double coded_level(const Picture& picture, const Sensor& sensor, double level_dn) {
  const double black = sensor.black_level_dn, white = white_dn(sensor);
  const double share = std::clamp((level_dn - black) / (white - black), 0.0, 1.0);
  return white * std::pow(share, 1 / picture.gamma);
}

void develop(const Picture& picture, const Sensor& sensor, cv::Mat1f& levels) {
  for (float& level : levels) {
    level = static_cast<float>(coded_level(picture, sensor, double(level)));
  }
  if (!picture.sharpening) return;
  const auto [amount, radius_px] = *picture.sharpening;
  cv::Mat1f soft;
  cv::GaussianBlur(levels, soft, {}, radius_px, radius_px, cv::BORDER_REPLICATE);
  levels += amount * (levels - soft);
}

std::string image_ending(const std::optional<Picture>& picture) {
  return picture && picture->jpeg_quality ? ".jpg" : ".png";
}

std::vector<unsigned char> encoded(const cv::Mat& image, const std::optional<Picture>& picture) {
  std::vector<unsigned char> bytes;
  if (picture && picture->jpeg_quality) {
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, *picture->jpeg_quality});
  } else {
    cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1});
  }
  return bytes;
}

}  // namespace vlp
