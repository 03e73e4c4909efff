// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vlp {
namespace {

constexpr double kFull = 65535;

/// Creates an image of 16 bits with noise around a level.
cv::Mat noise(double level, double sd) {
  cv::Mat1f image(300, 400);
  cv::RNG random(7);
  random.fill(image, cv::RNG::NORMAL, level, sd);
  cv::Mat levels;
  image.convertTo(levels, CV_16U);
  return levels;
}

/// Adds a lamp with the stripes of a rolling shutter.
void add_lamp(cv::Mat& image, double height) {
  for (int v = 100; v < 160; ++v) {
    if (v / 5 % 2 == 0) image(cv::Rect(150, v, 60, 1)) += height;
  }
}

TEST(MeasureImageSignal, ReturnsSignalToNoiseBelowSevenForPureNoise) {
  for (const double sd : {20., 300.}) {
    EXPECT_LT(measure_image_signal(noise(5000, sd)).signal_to_noise, 7) << sd;
    EXPECT_GT(measure_image_signal(noise(5000, sd)).signal_to_noise, 2) << sd;
  }
}

TEST(MeasureImageSignal, ReturnsSignalToNoiseOfLamp) {
  for (const double times : {10., 30., 100.}) {
    constexpr double sd = 50;
    cv::Mat image = noise(2000, sd);
    add_lamp(image, times * sd);
    const ImageSignal signal = measure_image_signal(image);
    // The noise's own range is about 6; the lamp's edges are a little of what is taken for noise.
    EXPECT_GT(signal.signal_to_noise, 0.9 * times) << times;
    EXPECT_LT(signal.signal_to_noise, times + 7) << times;
    EXPECT_NEAR(signal.dark_fraction, 2000 / kFull, 4 * sd / kFull);
  }
}

TEST(MeasureImageSignal, SignalToNoiseIgnoresSingleHotPixel) {
  cv::Mat image = noise(2000, 50);
  image.at<unsigned short>(20, 30) = 65535;
  EXPECT_LT(measure_image_signal(image).signal_to_noise, 7);
}

TEST(MeasureImageSignal, ReturnsHighSignalToNoiseForStripesOfOneScanline) {
  for (const bool rows : {true, false}) {
    cv::Mat image = noise(2000, 50);
    for (int i = 100; i < 200; i += 4) {
      image(rows ? cv::Rect(100, i, 100, 1) : cv::Rect(i, 100, 1, 100)) += 2000;
    }
    EXPECT_GT(measure_image_signal(image).signal_to_noise, 20) << rows;
  }
}

/// Without noise only the rounding remains: one level is 3.5 times its standard deviation.
TEST(MeasureImageSignal, AssumesAtLeastRoundingNoise) {
  cv::Mat1b image(300, 400, static_cast<unsigned char>(2));
  EXPECT_EQ(measure_image_signal(image).signal_to_noise, 0);
  image(cv::Rect(10, 10, 20, 20)) = static_cast<unsigned char>(3);
  EXPECT_NEAR(measure_image_signal(image).signal_to_noise, std::sqrt(12), 1e-9);
  EXPECT_NEAR(measure_image_signal(image).dark_fraction, 2.0 / 255, 1e-9);
}

}  // namespace
}  // namespace vlp
