// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "lamps/shape/drawn_disc.h"

namespace vlp {
namespace {

TEST(RefineDiscOutline, PointsLieOnCircleForUniformDisc) {
  for (const int depth : {CV_8U, CV_16U}) {
    for (const double blur_px : {0.7, 0.8}) {
      const DrawnDisc disc{.blur_px = blur_px};
      const auto points = refined_in(disc.image(depth), disc);
      EXPECT_GT(points.size(), 120U);
      EXPECT_LT(rms_off(disc, points), 0.02) << blur_px;
      EXPECT_LT(worst_off(disc, points, 0), 0.05) << blur_px;
    }
  }
}

TEST(RefineDiscOutline, ReducesDistanceFromCircleOfBlurredDisc) {
  const DrawnDisc disc{.blur_px = 1.2};
  const cv::Mat image = disc.image(CV_16U);
  EXPECT_GT(worst_off(disc, outline_in(image), kSteep), 0.2);
  EXPECT_LT(worst_off(disc, refined_in(image, disc), kSteep), 0.1);
}

TEST(RefineDiscOutline, PointsLieOnCircleForSmallDiscs) {
  for (const double radius_px : {8.0, 12.0, 16.0, 24.0}) {
    const DrawnDisc disc{.radius_px = radius_px};
    const auto points = refined_in(disc.image(CV_16U), disc);
    EXPECT_GT(double(points.size()), radius_px);
    EXPECT_LT(worst_off(disc, points, 0), 0.05) << radius_px;
  }
}

TEST(RefineDiscOutline, PointsLieOnCircleWithBrightnessGradient) {
  for (const double change : {-0.3, 0.15, 0.3}) {
    const DrawnDisc disc{.change = change};
    const auto points = refined_in(disc.image(CV_16U), disc);
    EXPECT_GT(points.size(), 120U);
    EXPECT_LT(rms_off(disc, points), 0.02) << change;
    EXPECT_LT(worst_off(disc, points, 0), 0.05) << change;
  }
}

TEST(RefineDiscOutline, MeanPointOffsetIsSmallForSmallDiscsWithGradient) {
  for (const double radius_px : {8.0, 10.0, 12.0, 16.0}) {
    for (const double change : {0.1, 0.3}) {
      const DrawnDisc disc{.radius_px = radius_px, .change = change};
      std::array<double, 2> sums_px{}, counts{};
      for (const EdgePoint& point : refined_in(disc.image(CV_16U), disc)) {
        sums_px.at(point.is_run_begin) += disc.off(point.pixel);
        ++counts.at(point.is_run_begin);
      }
      const double left_px = sums_px[1] / counts[1], right_px = sums_px[0] / counts[0];
      EXPECT_NEAR(left_px, 0, 0.06) << radius_px << ", " << change;
      EXPECT_NEAR(right_px, left_px, 0.03) << radius_px << ", " << change;
    }
  }
}

TEST(RefineDiscOutline, MeanRadialOffsetIsSmallUnderBlurAndDarkRim) {
  for (const auto& [radius_px, blur_px] : {std::pair(12.0, 1.0), {24.0, 0.5}, {24.0, 1.0}}) {
    for (const double fall : {0.0, 0.3}) {
      const DrawnDisc disc{.radius_px = radius_px, .blur_px = blur_px, .fall = fall};
      double sum_px = 0;
      const auto points = refined_in(disc.image(CV_16U), disc);
      for (const EdgePoint& point : points) sum_px += disc.off(point.pixel);
      const double mean_px = sum_px / double(points.size());
      const double drawn_in_px =
          disc.blur_px * disc.blur_px / (2 * radius_px);  // without correction
      EXPECT_NEAR(mean_px, 0, 0.6 * drawn_in_px) << radius_px << ", " << fall;
    }
  }
}

/// Adds noise of this standard deviation, in gray levels.
cv::Mat noisy(const cv::Mat& image, double noise, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat1f levels;
  image.convertTo(levels, CV_32F);
  for (float& level : levels) level += static_cast<float>(random.gaussian(noise));
  cv::Mat result;
  levels.convertTo(result, image.depth());
  return result;
}

TEST(RefineDiscOutline, ReportsMottledForDiscsWithVisibleChips) {
  for (const double radius_px : {24.0, 38.4}) {
    for (const double chips : {0.1, 0.3, 0.6}) {
      for (const double pitch_px : {5.0, 9.0}) {
        SCOPED_TRACE(testing::Message() << radius_px << ", " << chips << ", " << pitch_px);
        const DrawnDisc disc{
            .radius_px = radius_px, .level = 0.5, .chips = chips, .pitch_px = pitch_px};
        EXPECT_TRUE(refined_outline_in(disc.image(CV_16U), disc).is_mottled);
        EXPECT_TRUE(refined_outline_in(noisy(disc.image(CV_8U), 1, 3), disc).is_mottled);
      }
    }
  }
}

TEST(RefineDiscOutline, ReportsNotMottledForNoiseGradientOrDarkRim) {
  std::uint64_t seed = 0;
  for (const double noise : {0.0, 0.5, 2.0, 6.0}) {
    for (const auto& [change, fall] : {std::pair(0.0, 0.0), {0.3, 0.0}, {0.0, 0.3}, {0.15, 0.15}}) {
      for (const double radius_px : {24.0, 38.4}) {
        SCOPED_TRACE(testing::Message() << noise << ", " << change << ", " << fall);
        const DrawnDisc disc{.radius_px = radius_px, .level = 0.6, .change = change, .fall = fall};
        const RefinedOutline outline =
            refined_outline_in(noisy(disc.image(CV_8U), noise, ++seed), disc);
        ASSERT_FALSE(outline.points.empty());
        EXPECT_FALSE(outline.is_mottled);
      }
    }
  }
}

TEST(RefineDiscOutline, PointsLieNearCircleForMottledDisc) {
  const DrawnDisc disc{.level = 0.5, .chips = 0.3};
  const auto points = refined_in(disc.image(CV_16U), disc);
  EXPECT_GT(points.size(), 100U);
  EXPECT_LT(rms_off(disc, points), 0.12);
}

TEST(RefineDiscOutline, ExcludesPointsWhereRowsCrossOutlineAtFlatAngles) {
  const DrawnDisc disc;
  const cv::Mat image = disc.image(CV_16U);
  const double sine_20_deg = 0.342;
  EXPECT_TRUE(std::ranges::any_of(outline_in(image), [&](const EdgePoint& point) {
    return disc.cosine(point.pixel) < sine_20_deg - 0.03;
  }));
  const auto points = refined_in(image, disc);
  ASSERT_FALSE(points.empty());
  for (const EdgePoint& point : points) {
    EXPECT_GT(disc.cosine(point.pixel), sine_20_deg - 0.03);
  }
}

}  // namespace
}  // namespace vlp
