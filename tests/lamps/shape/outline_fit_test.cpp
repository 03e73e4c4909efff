// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline_fit.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "lamps/shape/drawn_disc.h"
#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

/// Adds noise of this standard deviation, in gray levels.
cv::Mat add_noise(const cv::Mat& image, double noise, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat1f levels;
  image.convertTo(levels, CV_32F);
  for (float& level : levels) level += static_cast<float>(random.gaussian(noise));
  cv::Mat result;
  levels.convertTo(result, image.depth());
  return result;
}

/// Fits the outline of a steady disc without a lens, from a center and radius with an error.
std::optional<OutlineFit> fit_drawn_disc(const cv::Mat& image, const DrawnDisc& disc,
                                         const Vector2d& start_error_px = {0.4, -0.3},
                                         double start_blur_px = 1.2,
                                         const std::optional<KnownRadius>& known = {}) {
  const ImageView view = to_image_view(image);
  return fit_disc_outline(
      view, {disc.center + start_error_px, Matrix2::Identity() / (disc.radius_px + 0.5)},
      start_blur_px, 0, estimate_image_background(view), LightShape({Readout::rows, {}, {}}),
      known);
}

TEST(FitDiscOutline, FindsCenterRadiusAndBlurOfUniformDisc) {
  for (const int depth : {CV_8U, CV_16U}) {
    for (const double blur_px : {0.6, 0.9, 1.3}) {
      for (const double radius_px : {12.0, 24.0, 38.4}) {
        const DrawnDisc disc{.radius_px = radius_px, .blur_px = blur_px};
        const auto fit = fit_drawn_disc(disc.image(depth), disc);
        ASSERT_TRUE(fit) << radius_px << ", " << blur_px;
        EXPECT_THAT(fit->outline.center, IsNear(disc.center, 0.005))
            << radius_px << ", " << blur_px;
        EXPECT_NEAR(fit->radius_px, radius_px, 0.35 * blur_px + 0.1);
        EXPECT_GT(fit->blur_px, 0.5 * blur_px);
        EXPECT_LT(fit->blur_px, 2 * blur_px);
      }
    }
  }
}

TEST(FitDiscOutline, CenterIsUnbiasedByGradientDarkRimAndOccluder) {
  for (const auto& [change, fall] : {std::pair(0.3, 0.0), {-0.15, 0.0}, {0.0, 0.3}, {0.15, 0.15}}) {
    DrawnDisc disc{.change = change, .fall = fall};
    const auto fit = fit_drawn_disc(disc.image(CV_16U), disc);
    ASSERT_TRUE(fit);
    EXPECT_THAT(fit->outline.center, IsNear(disc.center, 0.02)) << change << ", " << fall;
    for (int column = 108; column < 116; ++column) disc.dark_columns.push_back(column);
    const auto hidden = fit_drawn_disc(disc.image(CV_16U), disc);
    ASSERT_TRUE(hidden);
    EXPECT_THAT(hidden->outline.center, IsNear(disc.center, 0.04)) << change << ", " << fall;
  }
}

TEST(FitDiscOutline, CenterIsAccurateForChipsBehindDiffuser) {
  for (const double chips : {0.1, 0.3, 0.6}) {
    for (const double pitch_px : {5.0, 9.0}) {
      const DrawnDisc disc{.level = 0.5, .chips = chips, .pitch_px = pitch_px};
      const auto fit = fit_drawn_disc(disc.image(CV_16U), disc);
      ASSERT_TRUE(fit);
      EXPECT_THAT(fit->outline.center, IsNear(disc.center, 0.05)) << chips << ", " << pitch_px;
    }
  }
}

TEST(FitDiscOutline, ConvergesFromWideBlur) {
  const DrawnDisc disc;
  const auto fit = fit_drawn_disc(disc.image(CV_16U), disc, {3, 2.5}, 4);
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->outline.center, IsNear(disc.center, 0.005));
}

/// Errors of many discs with noise, relative to the reported standard deviation.
TEST(FitDiscOutline, ReportedStandardDeviationsMatchErrors) {
  for (const double noise : {1.0, 4.0}) {
    Random random(7);
    double chi_square = 0;
    constexpr int trials = 60;
    for (int trial = 0; trial < trials; ++trial) {
      DrawnDisc disc{.radius_px = 20};
      disc.center += Vector2d(random.normal(), random.normal());
      const auto fit =
          fit_drawn_disc(add_noise(disc.image(CV_8U), noise, 100 + std::uint64_t(trial)), disc);
      ASSERT_TRUE(fit);
      chi_square += (fit->outline.center - disc.center).squaredNorm() / 2 /
                    std::pow(fit->center_sd_px, 2) / trials;
    }
    EXPECT_GT(chi_square, 0.5) << noise;
    EXPECT_LT(chi_square, 1.6) << noise;
  }
}

TEST(FitDiscOutline, KnownRadiusReducesErrorOfPartlyVisibleDisc) {
  const DrawnDisc whole;
  DrawnDisc part = whole;
  for (int column = 0; column < 112; ++column) part.dark_columns.push_back(column);
  const cv::Mat image = add_noise(part.image(CV_8U), 3, 5);
  const auto free = fit_drawn_disc(image, part);
  const auto known = fit_drawn_disc(image, part, {0.4, -0.3}, 1.2, KnownRadius{38.4, 0.001});
  ASSERT_TRUE(free);
  ASSERT_TRUE(known);
  EXPECT_THAT(known->outline.center, IsNear(whole.center, 1.5));
  EXPECT_GT(free->center_sd_px, known->center_sd_px);
}

TEST(FitDiscOutline, ReturnsNulloptOutsideImageAndForTinyDiscs) {
  const DrawnDisc disc;
  const cv::Mat image = disc.image(CV_8U);
  DrawnDisc outside = disc;
  outside.center = {-300, 80};
  EXPECT_FALSE(fit_drawn_disc(image, outside));
  DrawnDisc tiny = disc;
  tiny.radius_px = 0.2;
  EXPECT_FALSE(fit_drawn_disc(image, tiny));
}

TEST(FitDiscOutline, EquationsContainOvalityOfEllipse) {
  // Ellipse with 1 % ovality, seen by a pinhole lens.
  const std::array intrinsics{600.0, 600.0, 99.5, 79.5};
  const LightShape shape({Readout::rows, {}, Lens(LensModel::pinhole, intrinsics)});
  cv::Mat1w image(160, 200);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const double x = (column - 99.5) / (40 * 1.01), y = (row - 79.5) / (40 * 0.99);
      const double depth_px = 40 * (1 - std::hypot(x, y));
      image(row, column) =
          static_cast<std::uint16_t>(1000 + 40000 * std::erfc(-depth_px / std::sqrt(2.0)) / 2);
    }
  }
  const ImageView view = to_image_view(image);
  const auto fit = fit_disc_outline(view, {{0, 0}, Matrix2::Identity() * 600 / 40}, 0.9, 0,
                                    estimate_image_background(view), shape);
  ASSERT_TRUE(fit);
  MeasuredLight light{};
  ASSERT_TRUE(set_fitted_outline(*fit, shape, light));
  ASSERT_TRUE(light.outline_equations);
  const auto estimate = light.outline_equations->solve_with_oval_prior(std::nullopt);
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(estimate->p[3], 0.01, 0.002);
  EXPECT_NEAR(estimate->p[4], 0, 0.001);
  EXPECT_THAT(light.pixel, IsNear(Vector2d(99.5, 79.5), 0.01));
}

}  // namespace
}  // namespace vlp
