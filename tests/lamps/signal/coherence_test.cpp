// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/stripes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"
#include "support/random.h"

namespace vlp {
namespace {

const cv::Size kPictureSize(200, 160);

double coherence_in(const cv::Mat& pixels, const DrawnLamp& lamp) {
  const ImageView image = to_image_view(pixels);
  const Eigen::Vector2d half(lamp.radius_px, lamp.radius_px);
  return compute_stripe_coherence_between_parts(
      image, find_chords_in_ellipse(lamp.center - half, lamp.center + half, image.size()),
      estimate_image_background(image), lamp.stripes.period_lines);
}

double coherence_of_drawn(const DrawnLamp& lamp) {
  return coherence_in(render_lamps({lamp}, kPictureSize, CV_16U, 0.5), lamp);
}

TEST(ComputeStripeCoherenceBetweenParts, ReturnsNearlyOneForLampsOfAnyShape) {
  for (const double period : {3.7, 11.0, 40.0}) {
    EXPECT_GT(coherence_of_drawn(DrawnLamp{.stripes = {.period_lines = period}}), 0.99) << period;
  }
  EXPECT_GT(coherence_of_drawn(DrawnLamp{.glow = DrawnGlow{}}), 0.97);
  EXPECT_GT(coherence_of_drawn(DrawnLamp{.recess = DrawnRecess{}}), 0.97);
}

TEST(ComputeStripeCoherenceBetweenParts, ReturnsAboveNineTenthsWithOneHiddenPart) {
  const DrawnBar bar{std::numbers::pi / 2, 20, 14};
  EXPECT_GT(coherence_of_drawn(DrawnLamp{.bar = bar}), 0.9);
}

TEST(ComputeStripeCoherenceBetweenParts, ReturnsLessThanMinimumForTiltedBars) {
  const auto coherence_of_tilted_bars = [](double degrees) {
    DrawnLamp lamp;
    lamp.stripes.period_lines = 0.9 * lamp.radius_px;  // two periods
    const double slope = std::tan(degrees * std::numbers::pi / 180);
    cv::Mat1d image(kPictureSize);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        const Eigen::Vector2d away = Eigen::Vector2d(column, row) - lamp.center;
        image(row, column) = 1000 + 40000 * blurred_step(lamp.radius_px - away.norm(), 1) *
                                        lamp.stripes.lit(row - slope * away.x());
      }
    }
    cv::Mat levels;
    image.convertTo(levels, CV_16U);
    return coherence_in(levels, lamp);
  };
  EXPECT_GT(coherence_of_tilted_bars(2), kMinCoherence);
  EXPECT_LT(coherence_of_tilted_bars(12), kMinCoherence);
}

TEST(ComputeStripeCoherenceBetweenParts, HardlyEverExceedsMinimumForIndependentParts) {
  // Patches with the height of a quarter of a period and the width of a part.
  constexpr int trials = 2000, patch = 6;
  Random random(5);
  int coherent = 0;
  for (int trial = 0; trial < trials; ++trial) {
    cv::Mat pixels(120, 120, CV_8U, cv::Scalar(10));
    for (int row = 40; row < 80; row += patch) {
      for (int column = 40; column < 80; column += 7) {
        pixels(cv::Rect(column, row, 7, patch)) = random.uniform(10, 200);
      }
    }
    const ImageView image = to_image_view(pixels);
    coherent += compute_stripe_coherence_between_parts(
                    image, find_chords_in_ellipse({40, 40}, {80, 80}, image.size()), {10, 1, 14.5},
                    4 * patch) > kMinCoherence;
  }
  EXPECT_LE(coherent, 10);
}

TEST(ComputeStripeCoherenceBetweenParts, ReturnsZeroForTooFewScanlines) {
  const DrawnLamp lamp{.stripes = {.period_lines = 170}};
  EXPECT_EQ(coherence_of_drawn(lamp), 0);
  const cv::Mat pixels(120, 120, CV_8U, cv::Scalar(10));
  const ImageView image = to_image_view(pixels);
  EXPECT_EQ(
      compute_stripe_coherence_between_parts(
          image, find_chords_in_ellipse({200, 20}, {240, 60}, image.size()), {10, 1, 14.5}, 8),
      0);
}

}  // namespace
}  // namespace vlp
