// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/valid_region.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "camera/spline_grid.h"
#include "geometry/polygon.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr std::array kImager{801, 601};
constexpr double kMargin = 40;  // 4 % of 1000 px

/// Returns a lens without distortion.
Lens straight_lens() {
  std::vector<double> parameters{1000, 1000, 400, 300};
  parameters.resize(num_lens_parameters(LensModel::opencv8));
  return {LensModel::opencv8, parameters};
}

TEST(MakeValidRegion, ReturnsConvexHullOfCornersWithMargin) {
  const ImageRegion region = make_valid_region(
      {{200, 100}, {600, 100}, {400, 250}, {600, 500}, {200, 500}}, kImager, straight_lens());
  EXPECT_EQ(region.size(), 4U);
  EXPECT_NEAR(compute_area_fraction(region, kImager),
              (400 + 2 * kMargin) * (400 + 2 * kMargin) / (800 * 600), 1e-12);
  EXPECT_TRUE(polygon_contains(region, {161, 61}));
  EXPECT_TRUE(polygon_contains(region, {160, 300}));
  EXPECT_FALSE(polygon_contains(region, {159, 300}));
  EXPECT_FALSE(polygon_contains(region, {400, 541}));
}

TEST(MakeValidRegion, ClipsRegionToImage) {
  const ImageRegion region =
      make_valid_region({{5, 5}, {790, 5}, {790, 590}, {5, 590}}, kImager, straight_lens());
  EXPECT_NEAR(compute_area_fraction(region, kImager), 1, 1e-12);
  for (const Eigen::Vector2d& corner : region) {
    EXPECT_TRUE(corner.x() == 0 || corner.x() == 800);
    EXPECT_TRUE(corner.y() == 0 || corner.y() == 600);
  }
  EXPECT_TRUE(polygon_contains(region, {800, 600}));
}

TEST(MakeValidRegion, ReturnsEmptyRegionForCollinearCorners) {
  EXPECT_TRUE(make_valid_region({}, kImager, straight_lens()).empty());
  EXPECT_TRUE(
      make_valid_region({{1, 1}, {2, 2}, {3, 3}, {9, 9}}, kImager, straight_lens()).empty());
  EXPECT_EQ(compute_area_fraction({}, kImager), 0);
}

/// Matches a region with these vertices, up to rounding.
std::vector<testing::Matcher<const Eigen::Vector2d&>> near_vertices(const ImageRegion& vertices) {
  std::vector<testing::Matcher<const Eigen::Vector2d&>> matchers;
  for (const Eigen::Vector2d& vertex : vertices) matchers.emplace_back(IsNear(vertex, 1e-9));
  return matchers;
}

/// Returns a lens without a margin, so that the region is the clipped hull itself. It has rays in
/// the whole image.
Lens splined_lens() {
  constexpr SplineGrid grid{3, 10, 8, 100};
  std::vector<double> parameters{1000, 1000, 400, 300};
  parameters.resize(4 + 2 * grid.num_control_points());
  return {splined_lens_model(grid), parameters};
}

TEST(MakeValidRegion, ReturnsHullVerticesClockwiseFromLeftmostForSplinedLens) {
  const ImageRegion vertices{{100, 120}, {350, 40}, {700, 150}, {650, 500}, {120, 480}};
  ImageRegion corners = vertices;
  corners.insert(corners.end(), {{300, 300}, {110, 300}, {640, 480}, {225, 80}, {400, 200}});
  std::reverse(corners.begin(), corners.end());
  EXPECT_THAT(make_valid_region(corners, kImager, splined_lens()),
              testing::ElementsAreArray(vertices));
  EXPECT_GT(make_valid_region(corners, kImager, straight_lens()).front().y(), 79);
  EXPECT_LT(make_valid_region(corners, kImager, straight_lens()).front().x(), 61);
}

TEST(MakeValidRegion, ReturnsTriangleForThreeCornersAndEmptyRegionForTwo) {
  EXPECT_THAT(make_valid_region({{300, 50}, {100, 150}, {350, 250}}, kImager, splined_lens()),
              testing::ElementsAreArray(ImageRegion{{100, 150}, {300, 50}, {350, 250}}));
  EXPECT_TRUE(make_valid_region({{300, 50}, {100, 150}}, kImager, straight_lens()).empty());
  EXPECT_TRUE(make_valid_region({{300, 50}}, kImager, straight_lens()).empty());
}

/// Triangles with one vertex 100 px beyond a border and two vertices inside the image.
TEST(MakeValidRegion, ReplacesVertexBeyondBorderByCrossingsWithBorder) {
  EXPECT_THAT(make_valid_region({{-100, 300}, {400, 100}, {400, 500}}, kImager, splined_lens()),
              testing::UnorderedElementsAreArray(
                  near_vertices({{0, 260}, {400, 100}, {400, 500}, {0, 340}})));
  EXPECT_THAT(make_valid_region({{900, 200}, {400, 100}, {400, 500}}, kImager, splined_lens()),
              testing::UnorderedElementsAreArray(
                  near_vertices({{800, 180}, {400, 100}, {400, 500}, {800, 260}})));
  EXPECT_THAT(make_valid_region({{300, -100}, {100, 300}, {700, 400}}, kImager, splined_lens()),
              testing::UnorderedElementsAreArray(
                  near_vertices({{250, 0}, {100, 300}, {700, 400}, {380, 0}})));
  EXPECT_THAT(make_valid_region({{300, 700}, {100, 300}, {700, 500}}, kImager, splined_lens()),
              testing::UnorderedElementsAreArray(
                  near_vertices({{250, 600}, {100, 300}, {700, 500}, {500, 600}})));
}

TEST(MakeValidRegion, ReturnsWholeImageForRegionAbove98Point5Percent) {
  const ImageRegion smaller{{0, 0}, {787, 0}, {787, 600}, {0, 600}};
  EXPECT_THAT(make_valid_region(smaller, kImager, splined_lens()),
              testing::ElementsAreArray(smaller));
  EXPECT_THAT(make_valid_region({{0, 0}, {789, 0}, {789, 600}, {0, 600}}, kImager, splined_lens()),
              testing::ElementsAreArray(ImageRegion{{0, 0}, {800, 0}, {800, 600}, {0, 600}}));
}

/// Expects that every pixel of the region has a ray: those of a grid, and of the boundary.
void expect_all_rays(const ImageRegion& region, const Lens& lens) {
  ASSERT_GE(region.size(), 3U);
  int inside = 0;
  for (const Eigen::Vector2d& pixel : make_pixel_grid(kImager, 161)) {
    if (!polygon_contains(region, pixel)) continue;
    ++inside;
    EXPECT_TRUE(lens.unproject_pixel(pixel)) << pixel.transpose();
  }
  EXPECT_GT(inside, 1000);
  for (std::size_t i = 0; i < region.size(); ++i) {
    for (double along = 0; along < 1; along += 0.05) {
      const Eigen::Vector2d pixel =
          region[i] + along * (region[(i + 1) % region.size()] - region[i]);
      EXPECT_TRUE(lens.unproject_pixel(pixel)) << pixel.transpose();
    }
  }
}

/// The models fold within the image: OPENCV_FISHEYE 307 px from its center, where its distance
/// stops growing; OPENCVn with and without tangential and prism terms.
TEST(MakeValidRegion, LiesInsideImageOfRaysOfLensWithFold) {
  const std::array lenses{
      Lens(LensModel::fisheye, std::array{188.0, 192.0, 400.0, 300.0, 0.0, 0.0, -0.003, 0.0}),
      Lens(LensModel::opencv4, std::array{400.0, 400.0, 410.0, 290.0, -0.4, 0.0, 0.0, 0.0}),
      Lens(LensModel::opencv12, std::array{400.0, 400.0, 400.0, 300.0, -0.35, 0.0, 0.02, -0.01, 0.0,
                                           0.0, 0.0, 0.0, 0.03, 0.0, -0.02, 0.0})};
  for (const Lens& lens : lenses) {
    // Corners on rays up to 96 % of the fold's distance, at most 39 px beyond the margin.
    ImageRegion corners;
    double max_px = 0;
    for (double angle_rad = 0; angle_rad < 6.28; angle_rad += 0.1) {
      const Eigen::Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
      double reach_px = 0;
      while (lens.unproject_pixel(lens.principal_point_px() + (reach_px + 1) * direction))
        ++reach_px;
      ASSERT_GT(reach_px, 150);
      ASSERT_LT(reach_px, 390);
      max_px = std::max(max_px, reach_px);
      corners.emplace_back(lens.principal_point_px() + 0.96 * reach_px * direction);
    }
    const ImageRegion region = make_valid_region(corners, kImager, lens);
    expect_all_rays(region, lens);
    // No more than necessary is cut off: all corners remain.
    for (const Eigen::Vector2d& corner : corners) {
      const bool is_in_image =
          (corner.array() >= 0).all() && corner.x() <= 800 && corner.y() <= 600;
      EXPECT_TRUE(!is_in_image || polygon_contains(region, corner)) << corner.transpose();
    }
    EXPECT_LT(region.size(), 160U);
  }
}

TEST(MakeValidRegion, LiesInsideImagesOfRaysOfOtherLenses) {
  const std::array others{
      Lens(LensModel::fisheye, std::array{188.0, 192.0, 400.0, 300.0, 0.0, 0.0, -0.003, 0.0}),
      straight_lens()};
  const ImageRegion corners{{150, 150}, {650, 150}, {650, 450}, {150, 450}};
  const ImageRegion region = make_valid_region(corners, kImager, straight_lens(), others);
  expect_all_rays(region, others[0]);
  EXPECT_EQ(region, make_valid_region(corners, kImager, others[0]));
  EXPECT_NE(region, make_valid_region(corners, kImager, straight_lens()));
}

/// Most corners are beyond the fold, 307 px from the center, and have no ray.
TEST(MakeValidRegion, LiesInsideImageOfRaysIfMeanOfCornersHasNoRay) {
  const Lens lens(LensModel::fisheye,
                  std::array{188.0, 192.0, 400.0, 300.0, 0.0, 0.0, -0.003, 0.0});
  ImageRegion corners{{5, 5}, {60, 5}, {5, 60}, {30, 30}, {8, 40}, {40, 8}};
  EXPECT_TRUE(make_valid_region(corners, kImager, lens).empty());
  corners.insert(corners.end(), {{300, 200}, {500, 200}, {400, 400}});
  ASSERT_FALSE(lens.unproject_pixel({150, 105})) << "mean of the corners";
  const ImageRegion region = make_valid_region(corners, kImager, lens);
  expect_all_rays(region, lens);
  for (std::size_t i = 6; i < corners.size(); ++i)
    EXPECT_TRUE(polygon_contains(region, corners[i])) << i;
}

TEST(ComputeAreaFraction, ReturnsAreaDividedByAreaBetweenPixelCenters) {
  EXPECT_NEAR(compute_area_fraction({{0, 0}, {20, 0}, {20, 30}, {0, 30}}, {101, 61}), 0.1, 1e-12);
}

}  // namespace
}  // namespace vlp
