// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// In-camera processing of the sensor's levels.
#include "simulation/exposure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "simulation/plain_scene.h"

namespace vlp {
namespace {

const Sensor kSensor{8, 0.5, 0, 60000, 0, false, {}};

/// Returns electrons with one value to the left of column 20 and another from there on.
cv::Mat1f step(double left, double right) {
  cv::Mat1f electrons(20, 40, float(left));
  electrons.colRange(20, 40) = right;
  return electrons;
}

bool same(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0; }

TEST(SimulateSensorImage, AppliesGammaToBothLevelsOfStepEdge) {
  const cv::Mat image =
      simulate_sensor_image(kSensor, step(20, 200), 1, ImageProcessing{2.2, {}, {}});
  EXPECT_EQ(image.at<std::uint8_t>(10, 19), std::lround(255 * std::pow(10 / 255.0, 1 / 2.2)));
  EXPECT_EQ(image.at<std::uint8_t>(10, 20), std::lround(255 * std::pow(100 / 255.0, 1 / 2.2)));
}

TEST(ApplyToneCurve, MapsBlackLevelToZeroAndClipsAtWhite) {
  Sensor sensor = kSensor;
  sensor.black_level_dn = 15;
  const ImageProcessing picture{2, {}, {}};
  EXPECT_EQ(apply_tone_curve(picture, sensor, 15), 0);
  EXPECT_EQ(apply_tone_curve(picture, sensor, 3), 0) << "noise below it";
  EXPECT_EQ(apply_tone_curve(picture, sensor, 15 + 60), 255 * 0.5);
  EXPECT_EQ(apply_tone_curve(picture, sensor, 300), 255);
  sensor.bits = 16;
  EXPECT_EQ(apply_tone_curve(picture, sensor, 65535), 65535);
}

TEST(SimulateSensorImage, GammaOneGivesSameImageAsNoProcessing) {
  const Sensor noisy{16, 0.5, 0, 60000, 0, true, {}};
  const cv::Mat1f electrons = step(300, 3000);
  EXPECT_TRUE(same(simulate_sensor_image(noisy, electrons, 1, ImageProcessing{1, {}, {}}),
                   simulate_sensor_image(noisy, electrons, 1)));
}

const ImageProcessing kBayer{1, {}, {}, Bayer{0.5, 0.25}};

TEST(SimulateSensorImage, BayerImageOfUniformLightIsGray) {
  const cv::Mat image = simulate_sensor_image(kSensor, cv::Mat1f(20, 40, 200), 1, kBayer);
  ASSERT_EQ(image.type(), CV_8UC3);
  EXPECT_TRUE(same(image, cv::Mat(image.size(), CV_8UC3, cv::Scalar::all(100))));
}

TEST(SimulateSensorImage, BayerPixelAppearsOnlyInColorOfItsFilter) {
  struct Lit {
    int line, place, color;
    float electrons;
  };
  // Red filters pass half of the light, blue ones a quarter.
  for (const auto& [line, place, color, electrons] :
       {Lit{10, 20, 2, 80.F}, {10, 21, 1, 80.F}, {11, 20, 1, 80.F}, {11, 21, 0, 80.F}}) {
    cv::Mat1f light(20, 40, 0.F);
    light(line, place) = electrons;
    cv::Mat channels[3];
    cv::split(simulate_sensor_image(kSensor, light, 1, kBayer), channels);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(cv::countNonZero(channels[i]) > 0, i == color) << line << ", " << place;
    }
    const cv::Mat& channel = channels[color];
    EXPECT_EQ(channel.at<std::uint8_t>(line, place), 40);
    EXPECT_EQ(channel.at<std::uint8_t>(line, place + 1), color == 1 ? 10 : 20) << "of 4, or of 2";
    EXPECT_EQ(channel.at<std::uint8_t>(line + 1, place + 1), color == 1 ? 0 : 10);
  }
}

TEST(SimulateSensorImage, BayerImageReproducesLinearGradient) {
  cv::Mat1f light(20, 40);
  for (int line = 0; line < light.rows; ++line) {
    for (int place = 0; place < light.cols; ++place) {
      light(line, place) = 64 + 8 * float(line) + 4 * float(place);
    }
  }
  cv::Mat channels[3];
  cv::split(simulate_sensor_image(kSensor, light, 1, kBayer), channels);
  // Levels behind filters are rounded, and multiplied by up to four after.
  for (int line = 1; line + 1 < light.rows; ++line) {
    for (int place = 1; place + 1 < light.cols; ++place) {
      for (const cv::Mat& channel : channels) {
        EXPECT_NEAR(channel.at<std::uint8_t>(line, place), light(line, place) / 2, 2.1);
      }
    }
  }
}

TEST(ProcessGrayLevels, OvershootAtStepMatchesUnsharpMaskEquation) {
  const double amount = 0.8, radius_px = 1.5, low = 50, high = 100;
  const ImageProcessing picture{1, Sharpening{amount, radius_px}, {}};
  cv::Mat1f levels = step(low, high);
  process_gray_levels(picture, kSensor, levels);
  // Next to the edge the blurred image has (1 + g) / 2 of the step, with g the kernel's largest
  // weight.
  double sum = 0;
  for (int i = -6; i <= 6; ++i) sum += std::exp(-i * i / (2 * radius_px * radius_px));
  const double overshoot = amount * (high - low) * (1 - 1 / sum) / 2;
  EXPECT_NEAR(levels(10, 20), high + overshoot, 1e-3);
  EXPECT_NEAR(levels(10, 19), low - overshoot, 1e-3);
  EXPECT_NEAR(levels(10, 0), low, 1e-3);
  EXPECT_NEAR(levels(10, 39), high, 1e-3);
}

TEST(SimulateSensorImage, SharpensAfterToneCurveAndBeforeRounding) {
  const ImageProcessing curve{2, {}, {}}, curve_and_sharpening{2, Sharpening{1, 1}, {}};
  const double low = apply_tone_curve(curve, kSensor, 10),
               high = apply_tone_curve(curve, kSensor, 100);
  const cv::Mat image = simulate_sensor_image(kSensor, step(20, 200), 1, curve_and_sharpening);
  const ImageProcessing sharpening{1, Sharpening{1, 1}, {}};
  cv::Mat1f levels = step(low, high);
  process_gray_levels(sharpening, kSensor, levels);
  for (const int u : {18, 19, 20, 21}) {
    EXPECT_EQ(image.at<std::uint8_t>(10, u), std::lround(levels(10, u))) << u;
  }
}

TEST(EncodeImage, ReturnsLosslessPngWithoutJpegQuality) {
  const Sensor noisy{8, 0.5, 5, 60000, 8, true, {}};
  const cv::Mat image = simulate_sensor_image(noisy, step(50, 400), 1);
  for (const auto& picture :
       {std::optional<ImageProcessing>(), std::optional<ImageProcessing>({2.2, {}, {}})}) {
    EXPECT_EQ(image_extension(picture), ".png");
    EXPECT_TRUE(same(cv::imdecode(encode_image(image, picture), cv::IMREAD_UNCHANGED), image));
  }
}

TEST(EncodeImage, ReturnsJpegOfGivenQuality) {
  const Sensor noisy{8, 0.5, 5, 60000, 8, true, {}};
  const cv::Mat image = simulate_sensor_image(noisy, step(50, 400), 1);
  const ImageProcessing coarse{1, {}, 30}, fine{1, {}, 95};
  EXPECT_EQ(image_extension(fine), ".jpg");
  const auto bytes = encode_image(image, fine);
  EXPECT_EQ(bytes.at(0), 0xff);
  EXPECT_EQ(bytes.at(1), 0xd8);
  EXPECT_EQ(encode_image(image, fine), bytes);
  std::vector<unsigned char> expected;
  ASSERT_TRUE(cv::imencode(".jpg", image, expected, {cv::IMWRITE_JPEG_QUALITY, 95}));
  EXPECT_EQ(bytes, expected);
  EXPECT_GT(bytes.size(), encode_image(image, coarse).size());
  const cv::Mat found = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  EXPECT_EQ(found.type(), CV_8U);
  const double loss = cv::norm(found, image),
               coarse_loss =
                   cv::norm(cv::imdecode(encode_image(image, coarse), cv::IMREAD_UNCHANGED), image);
  EXPECT_GT(loss, 0);
  EXPECT_LT(loss, 0.5 * coarse_loss);
}

TEST(MakeLampShot, ImageNameIsPngUnlessJpegQualityIsGiven) {
  Scene scene = plain_scene();
  const LampShots captures{{0}, {{0, 0}}, {}, {0}, 0, 0, 1, 0.5, false};
  const CaptureSet set{"one", 5e-5, captures, {}};
  EXPECT_EQ(make_lamp_shot(scene, set, 0).image, "0000.png");
  scene.processing = ImageProcessing{2.2, {}, 90};
  EXPECT_EQ(make_lamp_shot(scene, set, 0).image, "0000.jpg");
}

}  // namespace
}  // namespace vlp
