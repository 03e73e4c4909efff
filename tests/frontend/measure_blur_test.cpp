// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace vlp {
namespace {

/// A checkerboard of squares of 40 px, its edges blurred by a Gaussian, turned by an angle so that
/// pixels sample the edges at all phases.
cv::Mat checkerboard(double sigma_px, double dark, double bright, double angle_rad = 0.15) {
  cv::Mat1b image(300, 400);
  const auto wave = [&](double at) {
    constexpr double period = 40;
    const double from_edge = at - period * std::round(at / period);
    const bool rising = static_cast<long>(std::lround(at / period)) % 2 == 0;
    return (rising ? 1 : -1) * std::erf(from_edge / (sigma_px * std::sqrt(2.0)));
  };
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double x = std::cos(angle_rad) * u + std::sin(angle_rad) * v;
      const double y = std::cos(angle_rad) * v - std::sin(angle_rad) * u;
      const double level = 0.5 + 0.5 * wave(x) * wave(y);
      image(v, u) = static_cast<unsigned char>(std::lround(dark + (bright - dark) * level));
    }
  }
  return image;
}

TEST(MeasureImageBlur, MatchesGaussianSigmaOfCheckerboardEdges) {
  // Edges with a blur of less than half a pixel are undersampled.
  for (const double sigma_px : {0.3, 0.5, 1.0, 2.0, 3.0, 5.0}) {
    for (const double angle_rad : {0.02, 0.15, 0.7}) {
      const double found_px =
          measure_image_blur(checkerboard(sigma_px, 20, 220, angle_rad)).sigma_px;
      std::printf("blur %.2f px at %.2f rad: %.3f px\n", sigma_px, angle_rad, found_px);
      EXPECT_NEAR(found_px, sigma_px, sigma_px < 0.5 ? 0.2 : 0.02 + 0.05 * sigma_px);
    }
  }
}

TEST(MeasureImageBlur, ReturnsSameSigmaForDifferentContrasts) {
  EXPECT_NEAR(measure_image_blur(checkerboard(2, 20, 60)).sigma_px,
              measure_image_blur(checkerboard(2, 20, 220)).sigma_px, 0.1);
}

TEST(MeasureImageBlur, ReturnsInfinityWithoutContrast) {
  const ImageBlur blur = measure_image_blur(cv::Mat1b(300, 400, static_cast<unsigned char>(3)));
  EXPECT_TRUE(std::isinf(blur.sigma_px));
  EXPECT_NEAR(blur.bright_fraction, 3.0 / 255, 1e-6);
}

}  // namespace
}  // namespace vlp
