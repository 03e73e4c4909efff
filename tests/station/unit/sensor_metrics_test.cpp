// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/sensor_metrics.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Images of a checkered board, and of two lamps on a dark ceiling, at varying places.
struct SensorMetrics : testing::Test {
  cv::Mat1b draw_board(int i) const {
    cv::Mat1b image(kHeight, kWidth, std::uint8_t{150});
    for (int y = 0; y < kHeight; y += kSquare) {
      for (int x = 0; x < kWidth; x += kSquare) {
        if ((x / kSquare + y / kSquare) % 2 == 0)
          image(cv::Rect(x + i, y + 2 * i, kSquare, kSquare) & cv::Rect(0, 0, kWidth, kHeight)) =
              20;
      }
    }
    return image;
  }
  cv::Mat1b draw_lamps(int i) const {
    cv::Mat1b image(kHeight, kWidth, std::uint8_t{3});
    for (const int x : {20, 70}) cv::circle(image, {x + 2 * i, 20 + 3 * i}, 9, {200}, cv::FILLED);
    return image;
  }
  template <typename Change>
  std::vector<Metric> measure(const Change& change) const {
    std::vector<fs::path> lamps, boards;
    for (int i = 0; i < 8; ++i) {
      cv::Mat1b board = draw_board(i), lamp = draw_lamps(i);
      change(board);
      change(lamp);
      boards.push_back(folder / ("board" + std::to_string(i) + ".png"));
      lamps.push_back(folder / ("lamp" + std::to_string(i) + ".png"));
      cv::imwrite(boards.back().string(), board);
      cv::imwrite(lamps.back().string(), lamp);
    }
    std::vector<Metric> metrics = measure_sensor(lamps, boards);
    for (const Metric& metric : measure_board_levels(boards)) metrics.push_back(metric);
    return metrics;
  }
  static constexpr int kWidth = 120, kHeight = 90, kSquare = 12;
  TemporaryFolder folder;
};

double value_of(const std::vector<Metric>& metrics, const std::string& name) {
  const auto value = find_metric_value(metrics, name);
  EXPECT_TRUE(value) << name;
  return value.value_or(-1);
}

TEST_F(SensorMetrics, MeasureLevelsAsFractionsOfFullScale) {
  const auto metrics = measure([](cv::Mat1b&) {});
  EXPECT_NEAR(value_of(metrics, "board_white"), 150 / 255.0, 1e-6);
  EXPECT_NEAR(value_of(metrics, "lamp_white"), 200 / 255.0, 1e-6);
  EXPECT_NEAR(value_of(metrics, "dark_level"), 3 / 255.0, 1e-6);
  EXPECT_EQ(value_of(metrics, "defective_pixels"), 0);
}

TEST_F(SensorMetrics, CountPixelsThatAreBrightInAllImagesOfLamps) {
  const auto metrics = measure([](cv::Mat1b& image) {
    for (const int x : {5, 50, 95}) image(40, x) = 160;  // as the white of the board
  });
  EXPECT_EQ(value_of(metrics, "defective_pixels"), 3);
}

TEST_F(SensorMetrics, CountPixelsThatAreDarkInAllImagesOfTheBoard) {
  EXPECT_EQ(value_of(measure([](cv::Mat1b& image) { image(10, 60) = 0; }), "defective_pixels"), 1);
  const auto metrics = measure([](cv::Mat1b& image) { image.col(60) = 0; });
  EXPECT_GE(value_of(metrics, "defective_pixels"), kHeight / 3) << "a dead column";
}

TEST_F(SensorMetrics, AreEmptyWithoutReadableImages) {
  EXPECT_TRUE(measure_sensor({}, {}).empty());
  EXPECT_TRUE(measure_board_levels({folder / "none.png"}).empty());
}

}  // namespace
}  // namespace vlp
