// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "frontend/mat_view.h"
#include "lamps/signal/stripes.h"

namespace vlp {
namespace {

TEST(ComputeScanlineSignal, ReturnsMeanOfEachScanlineMinusDarkLevel) {
  for (const int depth : {CV_8U, CV_16U}) {
    cv::Mat pixels(100, 120, depth, cv::Scalar(10));
    for (int row = 31; row <= 69; ++row) pixels(cv::Rect(40, row, 41, 1)) = 2 * row;
    const ImageView image = to_image_view(pixels);
    const auto signal = compute_scanline_signal(
        image, find_chords_in_ellipse({40, 30}, {80, 70}, image.size()), 10);
    ASSERT_EQ(signal.size(), 37U);  // nine tenths of the height: lines 32 to 68
    for (std::size_t i = 0; i < signal.size(); ++i) {
      EXPECT_DOUBLE_EQ(signal[i], 2.0 * (32 + double(i)) - 10);
    }
  }
}

TEST(ComputeScanlineSignal, ReturnsLevelBesideBrightCore) {
  cv::Mat pixels(100, 120, CV_8U, cv::Scalar(30));
  pixels(cv::Rect(57, 45, 10, 10)) = 200;
  const ImageView image = to_image_view(pixels);
  const auto signal = compute_scanline_signal(
      image, find_chords_in_ellipse({40, 30}, {80, 70}, image.size()), 10, true);
  ASSERT_EQ(signal.size(), 37U);
  for (const double level : signal) EXPECT_DOUBLE_EQ(level, 20);
}

TEST(ComputeScanlineSignal, IgnoresScanlinesOutsideImage) {
  const cv::Mat pixels(100, 120, CV_8U, cv::Scalar(50));
  const ImageView image = to_image_view(pixels);
  EXPECT_EQ(
      compute_scanline_signal(image, find_chords_in_ellipse({40, -20}, {80, 20}, image.size()), 10)
          .size(),
      19U);
  EXPECT_TRUE(
      compute_scanline_signal(image, find_chords_in_ellipse({40, 200}, {80, 240}, image.size()), 10)
          .empty());
  EXPECT_TRUE(
      compute_scanline_signal(image, find_chords_in_ellipse({200, 20}, {240, 60}, image.size()), 10)
          .empty());
  const auto values = compute_scanline_signal(
      image, find_chords_in_ellipse({-10, 80}, {30, 120}, image.size()), 10);
  ASSERT_EQ(values.size(), 18U);
  for (const double value : values) EXPECT_EQ(value, 40);
}

}  // namespace
}  // namespace vlp
