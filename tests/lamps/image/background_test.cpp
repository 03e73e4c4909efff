// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/background.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "frontend/mat_view.h"
#include "support/random.h"

namespace vlp {
namespace {

/// Returns a uniform image with noise. One pixel of `bright_every` at random is lit; none if it is
/// 0.
template <typename Level>
cv::Mat noisy(cv::Size size, double level, double noise, std::size_t bright_every, double bright) {
  Random random(7);
  cv::Mat_<Level> image(size);
  for (Level& pixel : image) {
    const bool lit = bright_every > 0 && random.index(bright_every) == 0;
    pixel = cv::saturate_cast<Level>(lit ? bright : level + noise * random.normal());
  }
  return image;
}

void expect_dark(const cv::Mat& image, double level, double noise) {
  const Background background = estimate_background_of(to_image_view(image));
  EXPECT_NEAR(background.level, level, 0.15 * noise + 0.5);
  EXPECT_NEAR(background.noise, noise, 0.1 * noise);
  EXPECT_DOUBLE_EQ(background.threshold, background.level + 4.5 * background.noise);
}

void expect_flat(const cv::Mat& image, double level) {
  const Background background = estimate_background_of(to_image_view(image));
  EXPECT_EQ(background.level, level);
  EXPECT_LT(background.noise, 0.5);
  EXPECT_EQ(background.threshold, level + 1.6);
}

TEST(EstimateBackgroundOf, MatchesLevelAndNoiseOfFlat8BitImages) {
  for (const cv::Size size : {cv::Size(97, 80), cv::Size(800, 600), cv::Size(1920, 1200)}) {
    for (const double noise : {2.0, 5.0, 10.0}) {
      SCOPED_TRACE(testing::Message() << size << ", " << noise);
      expect_dark(noisy<std::uint8_t>(size, 60, noise, 0, 0), 60, noise);
    }
  }
}

TEST(EstimateBackgroundOf, ThresholdExceedsNearlyAllPixelsOfFlatImages) {
  for (const double noise : {0.5, 2.0, 8.0}) {
    const cv::Mat image = noisy<std::uint8_t>({800, 600}, 60, noise, 0, 0);
    EXPECT_LT(cv::countNonZero(image > estimate_background_of(to_image_view(image)).threshold), 20)
        << noise;
  }
}

TEST(EstimateBackgroundOf, ReturnsExactLevelOfUniformBlackOrWhiteImages) {
  expect_flat(cv::Mat::zeros(600, 800, CV_8U), 0);
  expect_flat(cv::Mat::zeros(600, 800, CV_16U), 0);
  expect_flat(cv::Mat(600, 800, CV_8U, cv::Scalar(255)), 255);
  expect_flat(cv::Mat(600, 800, CV_16U, cv::Scalar(65535)), 65535);
}

TEST(EstimateBackgroundOf, MatchesNoiseWhenDarkLevelIsClipped) {
  // Models a brightened image that was black in most places.
  const cv::Mat image = cv::max(noisy<std::uint8_t>({800, 600}, 1, 1.2, 0, 0), 1);
  const Background background = estimate_background_of(to_image_view(image));
  EXPECT_NEAR(background.noise, 1.2, 0.3);
  EXPECT_LT(cv::countNonZero(image > background.threshold), 20);
}

TEST(EstimateBackgroundOf, LevelNoiseAndThresholdScaleWithLevelStep) {
  Random random(3);
  cv::Mat eight(600, 800, CV_8U), sixteen;
  for (const double dark : {0.2, 3.0, 40.0}) {
    for (int row = 0; row < eight.rows; ++row) {
      for (int column = 0; column < eight.cols; ++column) {
        const double lamp = row < 60 && column < 60 ? 3 * row : 0;
        eight.at<std::uint8_t>(row, column) =
            cv::saturate_cast<std::uint8_t>(dark + lamp + 0.8 * random.normal());
      }
    }
    const Background expected = estimate_background_of(to_image_view(eight));
    for (const int step : {16, 257}) {
      eight.convertTo(sixteen, CV_16U, step);
      const Background found = estimate_background_of(to_image_view(sixteen));
      EXPECT_NEAR(found.level / step, expected.level, 1e-9);
      EXPECT_NEAR(found.noise / step, expected.noise, 1e-9);
      EXPECT_NEAR(found.threshold / step, expected.threshold, 1e-9);
    }
  }
}

TEST(EstimateBackgroundOf, LevelAveragesAllColumnsOfColorFilterPattern) {
  // One of four columns is darker, as with a mosaic of color filters.
  for (const cv::Size size : {cv::Size(800, 600), cv::Size(1280, 960), cv::Size(1920, 1200)}) {
    for (int darker = 0; darker < 4; ++darker) {
      cv::Mat image(size, CV_8U, cv::Scalar(30));
      for (int column = darker; column < size.width; column += 4) image.col(column) = 20;
      EXPECT_NEAR(estimate_background_of(to_image_view(image)).level, 27.5, 0.1)
          << size << ", " << darker;
      EXPECT_FALSE(estimate_dark_background(to_image_view(image)));
    }
  }
}

TEST(EstimateDarkBackground, MatchesLevelAndNoiseOfDarkPixels) {
  for (const int lit_rows : {60, 300, 540}) {  // of 600
    cv::Mat image = noisy<std::uint8_t>({800, 600}, 20, 3, 0, 0);
    image.rowRange(30, 30 + lit_rows) += 150;
    const auto background = estimate_dark_background(to_image_view(image));
    ASSERT_TRUE(background) << lit_rows;
    EXPECT_NEAR(background->level, 20, 0.5) << lit_rows;
    EXPECT_NEAR(background->noise, 3, 0.4) << lit_rows;
  }
}

TEST(EstimateDarkBackground, ReturnsNulloptForNoise) {
  for (const double level : {0.0, 2.0, 60.0}) {  // clipped at black, or not
    for (const double noise : {0.5, 3.0, 10.0}) {
      const cv::Mat image = noisy<std::uint8_t>({800, 600}, level, noise, 0, 0);
      EXPECT_FALSE(estimate_dark_background(to_image_view(image))) << level << ", " << noise;
    }
  }
}

}  // namespace
}  // namespace vlp
