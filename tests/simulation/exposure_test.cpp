// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The sensor, by the photon transfer method.
#include "simulation/exposure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vlp {
namespace {

struct Statistics {
  double mean, variance;
};

/// Returns mean and variance of an image of a flat field with this mean.
Statistics measured(const Sensor& sensor, double electrons, std::uint64_t seed = 1) {
  const cv::Mat image = simulate_sensor_image(sensor, cv::Mat1f(500, 500, float(electrons)), seed);
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return {mean[0], deviation[0] * deviation[0]};
}

class SimulateSensorImageNoise : public testing::TestWithParam<double> {};

TEST_P(SimulateSensorImageNoise, MeanAndVarianceMatchNoiseModel) {
  const double electrons = GetParam();
  for (const double read_noise_e : {0.0, 7.0}) {
    const Sensor sensor{16, 2, 100, 1e6, read_noise_e, true, {}};
    const auto [mean, variance] = measured(sensor, electrons);
    const double expected = 4 * (electrons + read_noise_e * read_noise_e);
    // 250,000 pixels: five sigma of each; rounding to whole levels adds 1/12 to read noise.
    EXPECT_NEAR(mean, 100 + 2 * electrons, 5 * std::sqrt(expected / 250000));
    EXPECT_NEAR(variance / (expected + (read_noise_e > 0 ? 1.0 / 12 : 0)), 1,
                5 * std::sqrt((2 + 1 / electrons) / 250000));
  }
}

INSTANTIATE_TEST_SUITE_P(Means, SimulateSensorImageNoise,
                         testing::Values(0.05, 0.7, 3, 10, 15.9, 16.1, 40, 300, 10000));

TEST(SimulateSensorImage, SlopeOfVarianceOverMeanIsGain) {
  const Sensor sensor{8, 0.02, 4, 13000, 8, true, {}};
  const Statistics low = measured(sensor, 3000), high = measured(sensor, 12000);
  EXPECT_NEAR((high.variance - low.variance) / (high.mean - low.mean) / 0.02, 1, 0.015);
}

TEST(SimulateSensorImage, ReturnsGainTimesElectronsPlusBlackLevelWithoutNoise) {
  const Sensor sensor{16, 0.5, 10, 60000, 0, false, {}};
  EXPECT_EQ(simulate_sensor_image(sensor, cv::Mat1f(1, 1, 1000.0f), 1).at<std::uint16_t>(0, 0),
            510);
  const Sensor eight{8, 0.01, 3, 60000, 0, false, {}};
  EXPECT_EQ(simulate_sensor_image(eight, cv::Mat1f(1, 1, 1000.0f), 1).at<std::uint8_t>(0, 0), 13);
}

TEST(SimulateSensorImage, ClipsAtFullWellAndAtLargestGrayLevel) {
  const Sensor sensor{16, 1, 0, 5000, 0, false, {}};
  EXPECT_EQ(simulate_sensor_image(sensor, cv::Mat1f(1, 1, 9000.0f), 1).at<std::uint16_t>(0, 0),
            5000);
  const Sensor narrow{8, 1, 0, 5000, 0, false, {}};
  EXPECT_EQ(simulate_sensor_image(narrow, cv::Mat1f(1, 1, 9000.0f), 1).at<std::uint8_t>(0, 0), 255);
}

TEST(SimulateSensorImage, BloomAddsGivenFractionOfOverflowToNeighbors) {
  cv::Mat1f electrons(101, 101, 0.0f);
  electrons(50, 50) = 15000;
  const Sensor sensor{16, 1, 0, 5000, 0, false, Bloom{0.4, 2}};
  const cv::Mat image = simulate_sensor_image(sensor, electrons, 1);
  EXPECT_EQ(image.at<std::uint16_t>(50, 50), 5000);
  // The central value of the Gaussian, 1 / (2 pi sigma^2), stays in the full pixel.
  EXPECT_NEAR(cv::sum(image)[0] - 5000, 0.4 * 10000 * (1 - 1 / (2 * M_PI * 4)), 60);
  EXPECT_GT(image.at<std::uint16_t>(50, 53), image.at<std::uint16_t>(50, 55));
  EXPECT_EQ(image.at<std::uint16_t>(50, 53), image.at<std::uint16_t>(47, 50));
}

TEST(SimulateSensorImage, NoiseIsSameForSameSeedAndDiffersForOther) {
  const Sensor sensor{16, 1, 100, 60000, 5, true, {}};
  const cv::Mat1f flat(100, 100, 50.0f);
  const cv::Mat one = simulate_sensor_image(sensor, flat, 1),
                again = simulate_sensor_image(sensor, flat, 1);
  const cv::Mat other = simulate_sensor_image(sensor, flat, 2);
  EXPECT_EQ(cv::countNonZero(one != again), 0);
  EXPECT_GT(cv::countNonZero(one != other), 9000);
}

TEST(SimulateSensorImage, NoiseOfNeighboringPixelsIsUncorrelated) {
  const Sensor sensor{16, 1, 1000, 60000, 20, true, {}};
  const cv::Mat1f levels(simulate_sensor_image(sensor, cv::Mat1f(500, 500, 100.0f), 3));
  const cv::Mat1f noise(levels - 1100);
  const double power = noise.dot(noise);
  for (const cv::Point& step : {cv::Point(1, 0), cv::Point(0, 1)}) {
    const cv::Mat1f a = noise(cv::Rect(0, 0, 499, 499));
    const cv::Mat1f b = noise(cv::Rect(step.x, step.y, 499, 499));
    EXPECT_NEAR(a.dot(b) / power, 0, 5.0 / 500);
  }
}

}  // namespace
}  // namespace vlp
