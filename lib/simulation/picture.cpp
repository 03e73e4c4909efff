// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "codecs/codecs.h"

namespace vlp {

double white_dn(const Sensor& sensor) { return sensor.bits == 8 ? 255 : 65535; }

int filter_at(int line, int place) {
  const auto parity = [](int i) { return ((i % 2) + 2) % 2; };
  return 2 - parity(line) - parity(place);
}

double passed_share(const Bayer& bayer, int line, int place) {
  const std::array shares{bayer.blue_share, 1.0, bayer.red_share};
  return shares[static_cast<std::size_t>(filter_at(line, place))];
}

std::vector<cv::Mat1f> colours_of(const Bayer& bayer, const Sensor& sensor,
                                  const cv::Mat1f& levels) {
  // The weights over the 3 x 3 neighborhood add up to 1 over the pixels that have the color.
  const cv::Matx33f corners(.25F, .5F, .25F, .5F, 1, .5F, .25F, .5F, .25F);
  const cv::Matx33f sides(0, .25F, 0, .25F, 1, .25F, 0, .25F, 0);
  const auto black = static_cast<float>(sensor.black_level_dn);
  const std::array shares{bayer.blue_share, 1.0, bayer.red_share};
  std::vector<cv::Mat1f> colours(3);
  for (int colour = 0; colour < 3; ++colour) {
    cv::Mat1f own(levels.size(), 0);
    for (int line = 0; line < levels.rows; ++line) {
      for (int place = 0; place < levels.cols; ++place) {
        if (filter_at(line, place) == colour) own(line, place) = levels(line, place) - black;
      }
    }
    cv::Mat1f& filled = colours[static_cast<std::size_t>(colour)];
    // Mirrored at the border pixels, which continues the mosaic.
    cv::filter2D(own, filled, CV_32F, colour == 1 ? sides : corners, {-1, -1}, 0,
                 cv::BORDER_REFLECT_101);
    filled = filled / shares[static_cast<std::size_t>(colour)] + black;
  }
  return colours;
}

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
  const std::string bytes =
      picture && picture->jpeg_quality
          ? codecs().encode(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, *picture->jpeg_quality})
          : codecs().encode(".png", image, {cv::IMWRITE_PNG_COMPRESSION, 1});
  return {bytes.begin(), bytes.end()};
}

}  // namespace vlp
