// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/exposure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "codecs/codecs.h"

namespace vlp {
namespace {

/// Returns a Poisson random number. Means below 16: adds up probabilities until the sum passes a
/// uniform random number.
///
/// Means from 16 on: quantile of a normal random number with the skewness correction of Cornish and
/// Fisher (1938), rounded. Correction and rounding add 1/18 + 1/12 to the variance, which is
/// subtracted beforehand. Mean and variance are exact, the distribution nearly.
float draw_poisson(float mean, cv::RNG& random) {
  constexpr float small = 16;
  if (mean <= 0) return 0;
  if (mean < small) {
    const double limit = random.uniform(0.0, 1.0);
    double probability = std::exp(-double(mean)), sum = probability;
    int count = 0;
    for (; limit > sum && count < 200; sum += probability) probability *= double(mean) / ++count;
    return static_cast<float>(count);
  }
  constexpr double added = 1.0 / 18 + 1.0 / 12;
  const double z = random.gaussian(1);
  return static_cast<float>(
      std::max(0.0, std::round(mean + std::sqrt(mean - added) * z + (z * z - 1) / 6)));
}

void add_blooming(const Bloom& bloom, float full_well_e, cv::Mat1f& electrons) {
  cv::Mat1f excess(electrons - full_well_e);
  excess = cv::max(excess, 0);
  if (cv::countNonZero(excess) == 0) return;
  cv::GaussianBlur(excess, excess, {}, bloom.sigma_px, bloom.sigma_px, cv::BORDER_CONSTANT);
  electrons += bloom.fraction * excess;
}

void apply_filters(const Bayer& bayer, cv::Mat1f& electrons) {
  for (int line = 0; line < electrons.rows; ++line) {
    for (int place = 0; place < electrons.cols; ++place) {
      electrons(line, place) *= static_cast<float>(bayer_transmission(bayer, line, place));
    }
  }
}

}  // namespace

double white_level_dn(const Sensor& sensor) { return sensor.bits == 8 ? 255 : 65535; }

int bayer_color_at(int line, int place) {
  const auto parity = [](int i) { return ((i % 2) + 2) % 2; };
  return 2 - parity(line) - parity(place);
}

double bayer_transmission(const Bayer& bayer, int line, int place) {
  const std::array transmissions{bayer.blue_to_green_ratio, 1.0, bayer.red_to_green_ratio};
  return transmissions[static_cast<std::size_t>(bayer_color_at(line, place))];
}

std::vector<cv::Mat1f> demosaic(const Bayer& bayer, const Sensor& sensor, const cv::Mat1f& levels) {
  // The weights over the 3 x 3 neighborhood add up to 1 over the pixels that have the color.
  const cv::Matx33f corners(.25F, .5F, .25F, .5F, 1, .5F, .25F, .5F, .25F);
  const cv::Matx33f sides(0, .25F, 0, .25F, 1, .25F, 0, .25F, 0);
  const auto black = static_cast<float>(sensor.black_level_dn);
  const std::array transmissions{bayer.blue_to_green_ratio, 1.0, bayer.red_to_green_ratio};
  std::vector<cv::Mat1f> colors(3);
  for (int color = 0; color < 3; ++color) {
    cv::Mat1f channel(levels.size(), 0);
    for (int line = 0; line < levels.rows; ++line) {
      for (int place = 0; place < levels.cols; ++place) {
        if (bayer_color_at(line, place) == color)
          channel(line, place) = levels(line, place) - black;
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

double apply_tone_curve(const ImageProcessing& processing, const Sensor& sensor, double level_dn) {
  const double black = sensor.black_level_dn, white = white_level_dn(sensor);
  const double fraction = std::clamp((level_dn - black) / (white - black), 0.0, 1.0);
  return white * std::pow(fraction, 1 / processing.gamma);
}

void process_gray_levels(const ImageProcessing& processing, const Sensor& sensor,
                         cv::Mat1f& levels) {
  for (float& level : levels) {
    level = static_cast<float>(apply_tone_curve(processing, sensor, double(level)));
  }
  if (!processing.sharpening) return;
  const auto [amount, radius_px] = *processing.sharpening;
  cv::Mat1f soft;
  cv::GaussianBlur(levels, soft, {}, radius_px, radius_px, cv::BORDER_REPLICATE);
  levels += amount * (levels - soft);
}

std::string image_extension(const std::optional<ImageProcessing>& processing) {
  return processing && processing->jpeg_quality ? ".jpg" : ".png";
}

std::vector<unsigned char> encode_image(const cv::Mat& image,
                                        const std::optional<ImageProcessing>& processing) {
  const std::string bytes =
      processing && processing->jpeg_quality
          ? get_codecs().encode_image_file(".jpg", image,
                                           {cv::IMWRITE_JPEG_QUALITY, *processing->jpeg_quality})
          : get_codecs().encode_image_file(".png", image, {});
  return {bytes.begin(), bytes.end()};
}

cv::Mat simulate_sensor_image(const Sensor& sensor, const cv::Mat1f& mean_electrons,
                              std::uint64_t seed,
                              const std::optional<ImageProcessing>& processing) {
  cv::RNG random(seed);
  cv::Mat1f electrons = mean_electrons.clone();
  if (processing && processing->bayer) apply_filters(*processing->bayer, electrons);
  if (sensor.shot_noise) {
    for (float& value : electrons) value = draw_poisson(value, random);
  }
  const auto full_well = static_cast<float>(sensor.full_well_e);
  if (sensor.bloom) add_blooming(*sensor.bloom, full_well, electrons);
  electrons = cv::min(electrons, full_well);
  if (sensor.read_noise_e > 0) {
    cv::Mat1f noise(electrons.size());
    random.fill(noise, cv::RNG::NORMAL, 0, sensor.read_noise_e);
    electrons += noise;
  }
  const int type = sensor.bits == 8 ? CV_8U : CV_16U;
  cv::Mat image;
  if (!processing) {
    electrons.convertTo(image, type, sensor.gain_dn_per_e, sensor.black_level_dn);
    return image;
  }
  cv::Mat1f levels;
  electrons.convertTo(levels, CV_32F, sensor.gain_dn_per_e, sensor.black_level_dn);
  if (!processing->bayer) {
    process_gray_levels(*processing, sensor, levels);
    levels.convertTo(image, type);
    return image;
  }
  // The analog-to-digital converter rounds before demosaicing.
  for (float& level : levels)
    level = std::clamp(std::round(level), 0.F, float(white_level_dn(sensor)));
  auto colors = demosaic(*processing->bayer, sensor, levels);
  for (cv::Mat1f& color : colors) process_gray_levels(*processing, sensor, color);
  cv::Mat color_image;
  cv::merge(colors, color_image);
  color_image.convertTo(image, type);
  return image;
}

}  // namespace vlp
