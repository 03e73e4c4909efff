// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/edge_crossing.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "support/matchers.h"

namespace vlp {
namespace {

/// Corner between two black squares, the edges of which are parabolas.
struct CurvedEdgeCorner {
  Eigen::Vector2d corner_px{20.3, 19.6};
  std::array<double, 2> angles_rad{0.2, 1.7};
  std::array<double, 2> curvatures_per_px{0, 0};
  Eigen::Vector2d light_per_px{0, 0};
  double blur_px = 0.9;

  cv::Mat1b render_image() const {
    cv::Mat1b image(41, 41);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        const Eigen::Vector2d at = Eigen::Vector2d(column, row) - corner_px;
        double pattern = 1;
        for (std::size_t i = 0; i < 2; ++i) {
          const Eigen::Vector2d along(std::cos(angles_rad[i]), std::sin(angles_rad[i]));
          const double u = along.dot(at), v = along.x() * at.y() - along.y() * at.x();
          pattern *= std::erf((v - curvatures_per_px[i] * u * u) / (std::numbers::sqrt2 * blur_px));
        }
        image(row, column) =
            cv::saturate_cast<uchar>((120 + 70 * pattern) * (1 + light_per_px.dot(at)));
      }
    }
    return image;
  }

  std::optional<FittedCorner> fit_corner() const {
    return fit_edge_crossing(render_image(), corner_px + Eigen::Vector2d(0.4, -0.3),
                             {Eigen::Vector2d(1, 0.1), Eigen::Vector2d(-0.02, 1)}, 8);
  }
};

constexpr double kTolerance_px = 0.01;  // gray levels are rounded to integers

TEST(FitEdgeCrossing, ReturnsCornerOfStraightEdges) {
  const CurvedEdgeCorner corner;
  const auto found = corner.fit_corner();
  ASSERT_TRUE(found);
  EXPECT_THAT(found->pixel, IsNear(corner.corner_px, kTolerance_px));
}

TEST(FitEdgeCrossing, ReturnsCornerOfEdgesWithDifferentCurvatures) {
  for (const std::array<double, 2> curvatures :
       {std::array{0.01, 0.0}, {0.0, 0.01}, {-0.01, 0.02}, {0.02, 0.015}}) {
    CurvedEdgeCorner corner;
    corner.curvatures_per_px = curvatures;
    const auto found = corner.fit_corner();
    ASSERT_TRUE(found);
    EXPECT_THAT(found->pixel, IsNear(corner.corner_px, kTolerance_px))
        << curvatures[0] << " " << curvatures[1];
  }
}

/// The scatter of corners in noisy images agrees with the reported standard deviation.
TEST(FitEdgeCrossing, ReportsScatterOfNoisyImages) {
  for (const double noise : {2.0, 6.0}) {
    CurvedEdgeCorner corner;
    cv::RNG random(7);
    constexpr int images = 400;
    double squares_px2 = 0, variances_px2 = 0;
    for (int i = 0; i < images; ++i) {
      corner.corner_px = {20 + random.uniform(-0.5, 0.5), 20 + random.uniform(-0.5, 0.5)};
      cv::Mat levels, noise_levels(41, 41, CV_32F);
      corner.render_image().convertTo(levels, CV_32F);
      random.fill(noise_levels, cv::RNG::NORMAL, 0, noise);
      cv::Mat1b image;
      cv::Mat(levels + noise_levels).convertTo(image, CV_8U);
      const auto found = fit_edge_crossing(image, corner.corner_px,
                                           {Eigen::Vector2d(1, 0.1), Eigen::Vector2d(-0.02, 1)}, 8);
      ASSERT_TRUE(found);
      squares_px2 += (found->pixel - corner.corner_px).squaredNorm() / 2;
      variances_px2 += found->sd_px * found->sd_px;
    }
    EXPECT_NEAR(std::sqrt(squares_px2 / variances_px2), 0.9, 0.15) << noise;  // growth included
  }
}

TEST(FitEdgeCrossing, LightGradientDoesNotDisplaceCorner) {
  CurvedEdgeCorner corner;
  corner.light_per_px = {0.02, -0.01};
  corner.curvatures_per_px = {0.01, -0.01};
  const auto found = corner.fit_corner();
  ASSERT_TRUE(found);
  EXPECT_THAT(found->pixel, IsNear(corner.corner_px, kTolerance_px));
}

// Each image ends 4 px beyond the corner on one side, and is a part of a larger, black one.
TEST(FitEdgeCrossing, UsesOnlyPixelsInsideImage) {
  const CurvedEdgeCorner corner;
  const cv::Mat1b image = corner.render_image();
  constexpr int margin_px = 4, border_px = 10;
  const int column = static_cast<int>(corner.corner_px.x()),
            row = static_cast<int>(corner.corner_px.y());
  for (const cv::Rect& part :
       {cv::Rect(0, 0, column + margin_px, image.rows), cv::Rect(0, 0, image.cols, row + margin_px),
        cv::Rect(column - margin_px, 0, image.cols - column + margin_px, image.rows),
        cv::Rect(0, row - margin_px, image.cols, image.rows - row + margin_px)}) {
    SCOPED_TRACE(testing::Message() << part.x << " " << part.y << " " << part.size());
    const Eigen::Vector2d origin(part.x, part.y);
    cv::Mat1b larger;
    cv::copyMakeBorder(image(part).clone(), larger, border_px, border_px, border_px, border_px,
                       cv::BORDER_CONSTANT, cv::Scalar(0));
    const auto found = fit_edge_crossing(larger(cv::Rect({border_px, border_px}, part.size())),
                                         corner.corner_px - origin + Eigen::Vector2d(0.4, -0.3),
                                         {Eigen::Vector2d(1, 0.1), Eigen::Vector2d(-0.02, 1)}, 8);
    ASSERT_TRUE(found);
    EXPECT_THAT(found->pixel, IsNear(corner.corner_px - origin, kTolerance_px));
  }
}

TEST(FitEdgeCrossing, ReturnsNulloptWithoutCorner) {
  const std::array<Eigen::Vector2d, 2> along{Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)};
  EXPECT_FALSE(fit_edge_crossing(cv::Mat1b(41, 41, 100), {20, 20}, along, 8));
  EXPECT_FALSE(fit_edge_crossing(CurvedEdgeCorner().render_image(), {20, 20}, along, 2))
      << "13 pixels";
  EXPECT_FALSE(fit_edge_crossing(CurvedEdgeCorner().render_image(), {25, 20}, along, 8))
      << "far from the guess";
}

}  // namespace
}  // namespace vlp
