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

double filter_transmission(const Bayer& bayer, int line, int place) {
  const std::array transmissions{bayer.blue_share, 1.0, bayer.red_share};
  return transmissions[static_cast<std::size_t>(filter_at(line, place))];
}

std::vector<cv::Mat1f> demosaic(const Bayer& bayer, const Sensor& sensor, const cv::Mat1f& levels) {
  // The weights over the 3 x 3 neighborhood add up to 1 over the pixels that have the color.
  const cv::Matx33f corners(.25F, .5F, .25F, .5F, 1, .5F, .25F, .5F, .25F);
  const cv::Matx33f sides(0, .25F, 0, .25F, 1, .25F, 0, .25F, 0);
  const auto black = static_cast<float>(sensor.black_level_dn);
  const std::array transmissions{bayer.blue_share, 1.0, bayer.red_share};
  std::vector<cv::Mat1f> colors(3);
  for (int color = 0; color < 3; ++color) {
    cv::Mat1f channel(levels.size(), 0);
    for (int line = 0; line < levels.rows; ++line) {
      for (int place = 0; place < levels.cols; ++place) {
        if (filter_at(line, place) == color) channel(line, place) = levels(line, place) - black;
      }
    }
    cv::Mat1f& filled = colors[static_cast<std::size_t>(color)];
    // Mirrored at the border pixels, which continues the mosaic.
    cv::filter2D(channel, filled, CV_32F, color == 1 ? sides : corners, {-1, -1}, 0,
                 cv::BORDER_REFLECT_101);
    filled = filled / transmissions[static_cast<std::size_t>(color)] + black;
  }
  return colors;
}

double apply_tone_curve(const ImageProcessing& picture, const Sensor& sensor, double level_dn) {
  const double black = sensor.black_level_dn, white = white_dn(sensor);
  const double fraction = std::clamp((level_dn - black) / (white - black), 0.0, 1.0);
  return white * std::pow(fraction, 1 / picture.gamma);
}

void develop(const ImageProcessing& picture, const Sensor& sensor, cv::Mat1f& levels) {
  for (float& level : levels) {
    level = static_cast<float>(apply_tone_curve(picture, sensor, double(level)));
  }
  if (!picture.sharpening) return;
  const auto [amount, radius_px] = *picture.sharpening;
  cv::Mat1f soft;
  cv::GaussianBlur(levels, soft, {}, radius_px, radius_px, cv::BORDER_REPLICATE);
  levels += amount * (levels - soft);
}

std::string image_extension(const std::optional<ImageProcessing>& picture) {
  return picture && picture->jpeg_quality ? ".jpg" : ".png";
}

std::vector<unsigned char> encode_image(const cv::Mat& image,
                                        const std::optional<ImageProcessing>& picture) {
  const std::string bytes =
      picture && picture->jpeg_quality
          ? codecs().encode(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, *picture->jpeg_quality})
          : codecs().encode(".png", image, {cv::IMWRITE_PNG_COMPRESSION, 1});
  return {bytes.begin(), bytes.end()};
}

}  // namespace vlp
