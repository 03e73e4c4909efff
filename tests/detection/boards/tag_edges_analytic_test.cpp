// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tags whose blurred edges are computed analytically, with all quantities of their edges known.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "detection/boards/edge_fit.h"
#include "detection/boards/tag_edges.h"
#include "detection/boards/tone_curve.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Distribution function of the standard normal distribution.
double normal_cdf(double x) { return std::erfc(-x / std::numbers::sqrt2) / 2; }

/// Board whose tags have a black stripe of a quarter of their width, which keeps the bits far from
/// the edges.
Board make_board_with_wide_borders(double tag_spacing = 0.5) {
  Board board{"tag36h11", 1, 1, 0.1, tag_spacing, 3, false, 0, {false, BoardCorner::top_left}};
  return board;
}

/// Black quadrilateral with curved edges on white.
struct AnalyticTag {
  TagDetection::Corners corners_px;
  std::array<double, 4> quadratic_px{}, cubic_px{};
  double blur_px = 0.8, dark = 30, bright = 190;
  /// Relative gradient of the light, per px, from the middle of the tag.
  Eigen::Vector2d gradient{0, 0};

  Eigen::Vector2d center() const {
    return (corners_px[0] + corners_px[1] + corners_px[2] + corners_px[3]) / 4;
  }
  Eigen::Vector2d edge_middle(std::size_t k) const {
    return (corners_px[k] + corners_px[(k + 1) % 4]) / 2;
  }
  double light_factor(const Eigen::Vector2d& at) const { return 1 + gradient.dot(at - center()); }
  /// Returns the distance of a pixel from edge k, outwards and perpendicular to its chord.
  double compute_distance_px(std::size_t k, const Eigen::Vector2d& at) const {
    const Eigen::Vector2d chord = corners_px[(k + 1) % 4] - corners_px[k];
    Eigen::Vector2d across = Eigen::Vector2d(-chord.y(), chord.x()).normalized();
    if (across.dot(edge_middle(k) - center()) < 0) across = -across;
    const double w = 2 * chord.dot(at - edge_middle(k)) / chord.squaredNorm();
    return across.dot(at - edge_middle(k)) - (w * w - 1) * (quadratic_px[k] + cubic_px[k] * w);
  }
  /// Returns the fraction of black at a pixel.
  double compute_black_fraction(const Eigen::Vector2d& at) const {
    double fraction = 1;
    for (std::size_t k = 0; k < 4; ++k)
      fraction *= normal_cdf(-compute_distance_px(k, at) / blur_px);
    return fraction;
  }
};

struct Rendering {
  cv::Size size{140, 130};
  double gamma = 1, noise = 0;
  unsigned seed = 1;
};

cv::Mat1b render_tags(const std::vector<AnalyticTag>& tags, const Rendering& rendering = {}) {
  std::mt19937 generator(rendering.seed);
  std::normal_distribution<double> normal(0, 1);
  cv::Mat1b image(rendering.size);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const Eigen::Vector2d at(column, row);
      double light = tags.front().bright * tags.front().light_factor(at);
      for (const AnalyticTag& tag : tags) {
        light -= (tag.bright - tag.dark) * tag.light_factor(at) * tag.compute_black_fraction(at);
      }
      const double level = 255 * std::pow(light / 255, 1 / rendering.gamma);
      image(row, column) = cv::saturate_cast<uchar>(level + rendering.noise * normal(generator));
    }
  }
  return image;
}

/// Returns tags with corners that are displaced outwards along the diagonals.
std::vector<TagDetection> make_detections(const std::vector<AnalyticTag>& tags,
                                          double outwards_px = 0) {
  std::vector<TagDetection> detections;
  for (const AnalyticTag& tag : tags) {
    TagDetection detection{3, tag.corners_px};
    for (auto& corner : detection.corners_px) {
      corner += outwards_px * (corner - tag.center()).normalized();
    }
    detections.push_back(detection);
  }
  return detections;
}

/// Slanted quadrilateral of about 80 px with corners counterclockwise or clockwise in the image.
AnalyticTag make_quadrilateral(bool is_clockwise = false) {
  AnalyticTag tag{
      .corners_px = {Eigen::Vector2d(25.3, 99.6), {108.2, 107.1}, {114.7, 24.4}, {31.2, 18.3}}};
  if (is_clockwise) std::swap(tag.corners_px[1], tag.corners_px[3]);
  return tag;
}

AnalyticTag make_square(double low_px, double width_px) {
  const double high_px = low_px + width_px;
  return {.corners_px = {Eigen::Vector2d(low_px, high_px),
                         {high_px, high_px},
                         {high_px, low_px},
                         {low_px, low_px}}};
}

TEST(RefineTags, MeasuresCornersAndStepsOfStraightEdgesUnderUnevenLight) {
  for (const bool is_clockwise : {false, true}) {
    for (const double outwards_px : {-1.2, 0.0, 1.2}) {
      SCOPED_TRACE(outwards_px);
      AnalyticTag tag = make_quadrilateral(is_clockwise);
      tag.gradient = {0.002, -0.003};
      auto tags = make_detections({tag}, outwards_px);
      refine_tags(tags, render_tags({tag}), TagGeometry(make_board_with_wide_borders()));
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_THAT(tags[0].corners_px[k], IsNear(tag.corners_px[k], 0.01)) << k;
        EXPECT_NEAR(tags[0].curvatures[k].quadratic_px, 0, 0.01);
        EXPECT_NEAR(tags[0].curvatures[k].cubic_px, 0, 1e-9);
        const double factor = tag.light_factor(tag.edge_middle(k));
        EXPECT_NEAR(tags[0].steps[k].blur_px, tag.blur_px, 0.01) << k;
        EXPECT_NEAR(tags[0].steps[k].dark, tag.dark * factor, 0.5) << k;
        EXPECT_NEAR(tags[0].steps[k].bright, tag.bright * factor, 1) << k;
      }
    }
  }
}

TEST(RefineTags, MeasuresCurvatureOfEachEdge) {
  for (const bool is_clockwise : {false, true}) {
    for (const double outwards_px : {-0.3, 0.0, 0.8}) {
      SCOPED_TRACE(outwards_px);
      AnalyticTag tag = make_quadrilateral(is_clockwise);
      tag.quadratic_px = {0.3, -0.4, 0.9, -2};
      tag.cubic_px = {0, 0, 0, 0.5};
      auto tags = make_detections({tag}, outwards_px);
      refine_tags(tags, render_tags({tag}), TagGeometry(make_board_with_wide_borders()));
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_THAT(tags[0].corners_px[k], IsNear(tag.corners_px[k], 0.03)) << k;
        EXPECT_NEAR(tags[0].curvatures[k].quadratic_px, tag.quadratic_px[k], 0.02) << k;
        EXPECT_NEAR(tags[0].curvatures[k].cubic_px, tag.cubic_px[k], 0.03) << k;
      }
    }
  }
}

// Pixels extend to 2.5 px from the adjacent edges.
TEST(RefineTags, ReachIsFractionOfEdgeLengthWithFittedPixels) {
  for (const double outwards_px : {-1.4, 0.0, 1.4}) {
    const AnalyticTag tag = make_square(40.2, 40);
    auto tags = make_detections({tag}, outwards_px);
    refine_tags(tags, render_tags({tag}), TagGeometry(make_board_with_wide_borders()));
    const double expected = (40 - 2 * (2.5 - outwards_px / std::numbers::sqrt2)) / 40;
    for (const EdgeCurvature& curvature : tags[0].curvatures) {
      EXPECT_NEAR(curvature.reach, expected, 0.015) << outwards_px;
    }
  }
}

// The ends of a line that is fitted to n pixels have the variance 4 sigma^2 / n, those of a
// parabola 9 sigma^2 / n: corner_sds_px counts curvatures as known, and here they are estimated.
TEST(RefineTags, CornerSdsMatchErrorsOfNoisyImages) {
  AnalyticTag tag = make_quadrilateral();
  tag.gradient = {0.002, 0.001};
  double squares = 0;
  constexpr int images = 50;
  for (unsigned seed = 1; seed <= images; ++seed) {
    auto tags = make_detections({tag});
    refine_tags(tags, render_tags({tag}, {.noise = 4, .seed = seed}),
                TagGeometry(make_board_with_wide_borders()));
    for (std::size_t k = 0; k < 4; ++k) {
      ASSERT_GT(tags[0].corner_sds_px[k], 0);
      squares +=
          ((tags[0].corners_px[k] - tag.corners_px[k]) / tags[0].corner_sds_px[k]).squaredNorm();
    }
  }
  // The mean of 400 squares has a standard deviation of 7 %.
  EXPECT_NEAR(squares / (8 * images), 9 / 4.0, 0.35);
}

TEST(RefineTags, CornerSdsIncreaseWithInverseSineOfAngle) {
  std::vector<double> sds_px;
  for (const double angle_rad : {0.5, 0.9, std::numbers::pi / 2, 2.2}) {
    const Eigen::Vector2d origin(22.3, 100.2), right(60, 0),
        up(60 * std::cos(angle_rad), -60 * std::sin(angle_rad));
    AnalyticTag tag{.corners_px = {origin, origin + right, origin + right + up, origin + up}};
    const double shift_px = std::max(0.0, -up.x());
    for (auto& corner : tag.corners_px) corner.x() += shift_px;
    auto tags = make_detections({tag});
    refine_tags(tags, render_tags({tag}, {.size = {160, 130}, .noise = 4}),
                TagGeometry(make_board_with_wide_borders()));
    double variance_px2 = 0;
    for (const double sd_px : tags[0].corner_sds_px) variance_px2 += sd_px * sd_px / 4;
    ASSERT_GT(variance_px2, 0);
    sds_px.push_back(std::sqrt(variance_px2) * std::sin(angle_rad));
  }
  for (const double sd_px : sds_px) EXPECT_NEAR(sd_px / sds_px[2], 1, 0.1);
}

TEST(RefineTags, MeasuresStepsOfStronglyBlurredEdges) {
  for (const double blur_px : {1.4, 1.9, 2.4}) {
    SCOPED_TRACE(blur_px);
    AnalyticTag tag = make_quadrilateral();
    tag.blur_px = blur_px;
    auto tags = make_detections({tag});
    refine_tags(tags, render_tags({tag}), TagGeometry(make_board_with_wide_borders()));
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(tags[0].steps[k].blur_px, blur_px, 0.02 * blur_px) << k;
      EXPECT_NEAR(tags[0].steps[k].dark, tag.dark, 1) << k;
      EXPECT_NEAR(tags[0].steps[k].bright, tag.bright, 2) << k;
    }
  }
}

TEST(RefineTags, FitForTrueToneCurveReturnsCornersAndSteps) {
  for (const std::size_t curve : {1U, 3U}) {
    for (const double blur_px : {0.8, 1.6}) {
      SCOPED_TRACE(testing::Message() << kGammas[curve] << " " << blur_px);
      AnalyticTag tag = make_quadrilateral();
      tag.blur_px = blur_px;
      tag.quadratic_px = {0.2, -0.7, 0.3, 0};
      auto tags = make_detections({tag});
      const auto costs = refine_tags(tags, render_tags({tag}, {.gamma = kGammas[curve]}),
                                     TagGeometry(make_board_with_wide_borders()));
      ASSERT_EQ(costs.size(), kGammas.size());
      EXPECT_EQ(std::ranges::min_element(costs) - costs.begin(),
                static_cast<std::ptrdiff_t>(curve));
      ASSERT_EQ(tags[0].tone_curve_fits.size(), kGammas.size() - 1);
      const TagDetection::Outline& fit = tags[0].tone_curve_fits[curve - 1];
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_THAT(fit.corners_px[k], IsNear(tag.corners_px[k], 0.03)) << k;
        EXPECT_NEAR(fit.curvatures[k].quadratic_px, tag.quadratic_px[k], 0.02) << k;
        EXPECT_NEAR(fit.steps[k].blur_px, blur_px, 0.02) << k;
        EXPECT_NEAR(fit.steps[k].dark, tag.dark, 1) << k;
        EXPECT_NEAR(fit.steps[k].bright, tag.bright, 2) << k;
        EXPECT_GT(fit.corner_sds_px[k], 0) << k;
      }
    }
  }
}

TEST(RefineTags, ReturnsCornersButNoStepsOfSaturatedEdges) {
  for (const double gamma : {1.0, 2.0}) {
    AnalyticTag tag = make_quadrilateral();
    tag.bright = 330;
    auto tags = make_detections({tag});
    const auto costs = refine_tags(tags, render_tags({tag}, {.gamma = gamma}),
                                   TagGeometry(make_board_with_wide_borders()));
    ASSERT_FALSE(costs.empty());
    auto outlines = tags[0].tone_curve_fits;
    outlines.insert(outlines.begin(),
                    {tags[0].corners_px, tags[0].curvatures, tags[0].corner_sds_px, tags[0].steps});
    const std::size_t curve = gamma == 1 ? 0 : 3;
    ASSERT_LT(curve, outlines.size());
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_THAT(outlines[curve].corners_px[k], IsNear(tag.corners_px[k], 0.02)) << gamma << k;
      EXPECT_EQ(outlines[curve].steps[k], EdgeStep()) << gamma << k;
      EXPECT_GT(outlines[curve].corner_sds_px[k], 0) << gamma << k;
    }
  }
}

// The image is a part of a larger one, which is black outside.
TEST(RefineTags, UsesOnlyPixelsInsideImage) {
  const AnalyticTag tag = make_square(20.2, 40);
  for (const cv::Rect& part : {cv::Rect(18, 0, 80, 80), cv::Rect(0, 18, 80, 80),
                               cv::Rect(0, 0, 63, 80), cv::Rect(0, 0, 80, 63)}) {
    SCOPED_TRACE(testing::Message() << part.x << " " << part.y << " " << part.size());
    cv::Mat1b larger(160, 160, uchar{0});
    const cv::Mat1b inside = larger(cv::Rect({30, 30}, part.size()));
    render_tags({tag})(part).copyTo(inside);
    auto tags = make_detections({tag});
    for (auto& corner : tags[0].corners_px) corner -= Eigen::Vector2d(part.x, part.y);
    refine_tags(tags, inside, TagGeometry(make_board_with_wide_borders()));
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_THAT(tags[0].corners_px[k],
                  IsNear(tag.corners_px[k] - Eigen::Vector2d(part.x, part.y), 0.025));
      EXPECT_GT(tags[0].corner_sds_px[k], 0);
    }
  }
}

TEST(RefineTags, KeepsCornersOfTagMissingInImage) {
  const AnalyticTag tag = make_square(20.2, 40), missing = make_square(80.3, 30);
  auto tags = make_detections({tag, missing});
  const auto costs = refine_tags(tags, render_tags({tag}, {.gamma = 2}),
                                 TagGeometry(make_board_with_wide_borders()));
  EXPECT_EQ(costs.size(), kGammas.size());
  EXPECT_EQ(tags[1].corners_px, missing.corners_px);
  EXPECT_EQ(tags[1].corner_sds_px, TagDetection::CornerSds());
  EXPECT_EQ(tags[1].steps, TagDetection::Steps());
  ASSERT_EQ(tags[1].tone_curve_fits.size(), kGammas.size() - 1);
  EXPECT_EQ(tags[1].tone_curve_fits[2].corners_px, missing.corners_px);
  std::vector<TagDetection> alone{tags[1]};
  EXPECT_TRUE(
      refine_tags(alone, render_tags({tag}), TagGeometry(make_board_with_wide_borders())).empty());
}

// Tone curves are compared by the eight widest tags.
TEST(RefineTags, FitsAllOfTwelveTagsForEachToneCurve) {
  std::vector<AnalyticTag> drawn;
  for (int i = 0; i < 12; ++i) {
    AnalyticTag tag = make_square(14.2, 36 + 0.5 * i);
    for (auto& corner : tag.corners_px) corner += 62.0 * Eigen::Vector2d(i % 4, i / 4);
    drawn.push_back(tag);
  }
  auto tags = make_detections(drawn);
  const auto costs = refine_tags(tags, render_tags(drawn, {.size = {260, 200}, .gamma = 2}),
                                 TagGeometry(make_board_with_wide_borders()));
  EXPECT_EQ(costs.size(), kGammas.size());
  for (std::size_t i = 0; i < tags.size(); ++i) {
    ASSERT_EQ(tags[i].tone_curve_fits.size(), kGammas.size() - 1);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_THAT(tags[i].tone_curve_fits[2].corners_px[k], IsNear(drawn[i].corners_px[k], 0.015));
    }
  }
}

}  // namespace
}  // namespace vlp
