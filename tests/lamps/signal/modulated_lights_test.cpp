// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/modulated_lights.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"

namespace vlp {
namespace {

const cv::Size kSearchSize(420, 260);
constexpr std::array kLampPeriods_lines{9.0, 11.0, 14.5, 18.0, 24.0};

std::vector<ModulatedLight> find_lights(const cv::Mat& image, std::span<const double> periods) {
  const ImageView view = to_image_view(image);
  const std::array boxes{PixelBox{0, 0, view.width, view.height}};
  return detect_modulated_lights(view, boxes, estimate_background_of(view), periods);
}

DrawnLamp make_glow(const Eigen::Vector2d& center, double period_lines) {
  return {.center = center,
          .stripes = {.period_lines = period_lines},
          .glow = DrawnGlow{.fall_px = 18, .core_px = 14}};
}

TEST(DetectModulatedLights, IdentifiesGlowsAndLocatesTheirCenters) {
  for (std::size_t i = 0; i < kLampPeriods_lines.size(); ++i) {
    for (const int depth : {CV_8U, CV_16U}) {
      const Eigen::Vector2d center(203.3, 131.6);
      const auto lights = find_lights(
          render_lamps({make_glow(center, kLampPeriods_lines[i])}, kSearchSize, depth, 1),
          kLampPeriods_lines);
      ASSERT_EQ(lights.size(), 1U) << kLampPeriods_lines[i];
      EXPECT_EQ(lights[0].lamp, i);
      EXPECT_LT((lights[0].center - center).norm(), 2);
      EXPECT_NEAR(lights[0].stripes.period_lines / kLampPeriods_lines[i], 1, 0.01);
      EXPECT_GT(lights[0].stripes.coherence, 0.97);
    }
  }
}

TEST(DetectModulatedLights, ReturnsPeriodWithoutGivenLampPeriods) {
  const auto lights =
      find_lights(render_lamps({make_glow({203.3, 131.6}, 13)}, kSearchSize, CV_8U, 1), {});
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_FALSE(lights[0].lamp);
  EXPECT_NEAR(lights[0].stripes.period_lines, 13, 0.2);
}

TEST(DetectModulatedLights, ReturnsPeriodOfStripWithHardEnds) {
  constexpr double period = 21.92;
  for (const double phase : {0.0, 0.25, 0.5, 0.75}) {
    const DrawnStripes stripes{.period_lines = period, .phase = phase};
    cv::Mat image(600, 64, CV_8U, cv::Scalar(6));
    for (int line = 80; line < 520; ++line) {
      image(cv::Rect(24, line, 16, 1)) = 6 + 200 * stripes.lit(line);
    }
    for (const std::vector<double>& periods : {std::vector<double>{}, {period}}) {
      const auto lights = find_lights(image, periods);
      ASSERT_EQ(lights.size(), 1U) << phase;
      EXPECT_NEAR(lights[0].stripes.period_lines / period, 1, 1e-3) << phase;
    }
  }
}

TEST(DetectModulatedLights, ReportsNoLampForUnknownPeriod) {
  for (const double period : {10.0, 12.6, 16.0, 21.0}) {
    const auto lights =
        find_lights(render_lamps({make_glow({203.3, 131.6}, period)}, kSearchSize, CV_8U, 1),
                    kLampPeriods_lines);
    ASSERT_FALSE(lights.empty()) << period;
    for (const ModulatedLight& light : lights) EXPECT_FALSE(light.lamp) << period;
  }
}

/// A disc of bars that are tilted, so that their phase changes across the lines.
cv::Mat draw_bars(double period_lines, double tilt_rad) {
  cv::Mat image(kSearchSize, CV_8U);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const Eigen::Vector2d away(column - 203.3, row - 131.6);
      const double periods = (away.y() + std::tan(tilt_rad) * away.x()) / period_lines;
      const bool is_bright = away.norm() < 70 && periods - std::floor(periods) < 0.5;
      image.at<unsigned char>(row, column) = is_bright ? 180 : 4;
    }
  }
  return image;
}

/// Returns the lights that need no outline.
std::vector<ModulatedLight> find_certain_lights(const cv::Mat& image) {
  auto lights = find_lights(image, kLampPeriods_lines);
  std::erase_if(lights, [](const ModulatedLight& light) { return light.requires_outline; });
  return lights;
}

TEST(DetectModulatedLights, ReturnsNoCertainLightsForTiltedBars) {
  // Their phase changes by half of a period across the disc, and their mean is still modulated.
  for (const double period : {11.0, 18.0, 24.0}) {
    EXPECT_EQ(find_certain_lights(draw_bars(period, 0)).size(), 1U) << period;
    const double tilt_rad = std::atan(period / 2 / 140);
    EXPECT_TRUE(find_certain_lights(draw_bars(period, tilt_rad)).empty()) << period;
    EXPECT_TRUE(find_certain_lights(draw_bars(period, 3 * tilt_rad)).empty()) << period;
  }
}

TEST(DetectModulatedLights, CenterSdCoversOffsetOfBrightCore) {
  double squares = 0;
  int count = 0;
  for (const double angle : {0.3, 1.4, 2.5, 3.6, 4.7, 5.8}) {
    DrawnLamp lamp{.center = {203.3, 131.6}, .radius_px = 60, .stripes = {.period_lines = 11}};
    lamp.recess = DrawnRecess{.core_off_px = 30 * Eigen::Vector2d(std::cos(angle), std::sin(angle)),
                              .walls = 0.2};
    const auto lights =
        find_lights(render_lamps({lamp}, kSearchSize, CV_8U, 1), kLampPeriods_lines);
    ASSERT_EQ(lights.size(), 1U);
    EXPECT_EQ(lights[0].lamp, 1U);
    squares +=
        (lights[0].center - lamp.center).squaredNorm() / 2 / std::pow(lights[0].center_sd_px, 2);
    ++count;
  }
  EXPECT_LT(squares / count, 1.5);
}

TEST(DetectModulatedLights, ReturnsNoneForSteadyLightNoiseAndTinyImages) {
  const DrawnLamp steady{.center = {203.3, 131.6}, .radius_px = 70, .stripes = {.duty = 1}};
  EXPECT_TRUE(
      find_lights(render_lamps({steady}, kSearchSize, CV_8U, 1), kLampPeriods_lines).empty());
  EXPECT_TRUE(find_lights(render_lamps({}, kSearchSize, CV_8U, 2), kLampPeriods_lines).empty());
  EXPECT_TRUE(find_lights(cv::Mat(1, 1, CV_8U, cv::Scalar(200)), kLampPeriods_lines).empty());
  EXPECT_TRUE(find_lights(cv::Mat(2, 100, CV_8U, cv::Scalar(200)), {}).empty());
}

/// Returns the profile of three periods of a rim whose level grows by a quarter.
LineProfile make_uneven_profile(double period_lines, double phase) {
  LineProfile profile{20, 1, {}};
  const int lines = static_cast<int>(3 * period_lines);
  for (int line = 0; line < lines; ++line) {
    const double level = 20 + 5.0 * line / lines;
    const double turn_rad = 2 * std::numbers::pi * (line / period_lines + phase);
    profile.levels.push_back(level * (1 + 0.9 * std::sin(turn_rad)));
  }
  return profile;
}

TEST(IdentifyLampPeriod, IdentifiesThreePeriodsOfUnevenRim) {
  constexpr std::array periods_lines{9.0, 12.0, 16.0, 21.0, 28.0};
  constexpr int min_found = 12;  // of 25: few periods do not exclude neighbors
  int found = 0;
  for (std::size_t i = 0; i < periods_lines.size(); ++i) {
    for (const double phase : {0., 0.2, 0.4, 0.6, 0.8}) {
      const auto lamp =
          identify_lamp_period(make_uneven_profile(periods_lines[i], phase), periods_lines);
      if (!lamp) continue;
      EXPECT_EQ(lamp, i) << phase;
      ++found;
    }
  }
  EXPECT_GE(found, min_found);
}

TEST(IdentifyLampPeriod, ReturnsNulloptForOtherPeriodSteadyLightAndNoLines) {
  EXPECT_FALSE(identify_lamp_period(make_uneven_profile(33, 0), kLampPeriods_lines));
  EXPECT_FALSE(identify_lamp_period({0, 1, std::vector<double>(60, 80)}, kLampPeriods_lines));
  EXPECT_FALSE(identify_lamp_period({0, 1, {}}, kLampPeriods_lines));
  EXPECT_FALSE(identify_lamp_period(make_uneven_profile(9, 0), {}));
}

}  // namespace
}  // namespace vlp
