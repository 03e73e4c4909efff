// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "simulation/shapes.h"
#include "support/random.h"

namespace vlp {
namespace {

/// Returns the integral over a triangle from its edges.
template <typename Shape>
double integral_over(const Shape& shape, const std::array<Eigen::Vector2d, 3>& triangle) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    sum += shape.compute_edge_contribution_to_area_integral(triangle[i], triangle[(i + 1) % 3]);
  }
  return sum;
}

/// Returns the integral over a triangle from many sample points.
template <typename Value>
double sampled_integral(const Value& value, const std::array<Eigen::Vector2d, 3>& triangle) {
  constexpr int side = 1500;
  double sum = 0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      double a = (i + 0.5) / side, b = (j + 0.5) / side;
      if (a + b > 1) a = 1 - a, b = 1 - b;
      sum += value(Eigen::Vector2d(triangle[0] + a * (triangle[1] - triangle[0]) +
                                   b * (triangle[2] - triangle[0])));
    }
  }
  const double area = cross_product_2d(triangle[1] - triangle[0], triangle[2] - triangle[0]) / 2;
  return area * sum / (side * side);
}

std::array<Eigen::Vector2d, 3> random_triangle(Random& random, double reach) {
  std::array<Eigen::Vector2d, 3> triangle;
  for (auto& corner : triangle) {
    corner = {random.uniform(-reach, reach), random.uniform(-reach, reach)};
  }
  return triangle;
}

TEST(PatternLines, FindsSameCellAsBinarySearch) {
  Random random(3);
  for (const std::size_t count : {2u, 3u, 40u}) {
    std::vector<double> lines_m;
    for (std::size_t i = 0; i < count; ++i) {
      const double offset = random.uniform(0, 1);
      lines_m.push_back(0.3 * offset * offset - 0.1);  // unevenly
    }
    const PatternLines lines(lines_m);
    std::ranges::sort(lines_m);
    ASSERT_EQ(lines.coordinates_m(), lines_m);
    for (int i = 0; i < 2000; ++i) {
      const double at_m = i % 2 == 0 ? random.uniform(-0.3, 0.5) : lines_m[random.index(count)];
      EXPECT_EQ(lines.find_cell(at_m), std::ranges::upper_bound(lines_m, at_m) - lines_m.begin());
    }
  }
}

TEST(PatternLines, HandlesFewerThanTwoLines) {
  EXPECT_EQ(PatternLines(std::vector<double>{}).find_cell(1), 0);
  const PatternLines one(std::vector{0.5});
  EXPECT_EQ(one.find_cell(0.4), 0);
  EXPECT_EQ(one.find_cell(0.5), 1);
}

TEST(Disc, IntegralOverEnclosingTriangleIsThatOfWholeDisc) {
  const std::array<Eigen::Vector2d, 3> triangle{{{-5, -4}, {7, -3}, {0, 9}}};
  EXPECT_NEAR(integral_over(Disc({1, 1}, 1), triangle), std::numbers::pi, 1e-12);
  // 1 - fall r^2 over the unit disc: pi (1 - fall / 2)
  EXPECT_NEAR(integral_over(Disc({1, 1}, 0.4), triangle), std::numbers::pi * 0.7, 1e-12);
}

// Sampling takes long where tests are not optimized.
#ifdef __SANITIZE_ADDRESS__
constexpr int kTriangles = 4;
#else
constexpr int kTriangles = 20;
#endif

TEST(Disc, IntegralOverRandomTriangleMatchesSampling) {
  Random random(1);
  const double rim_to_center_ratio = 0.3;
  const Disc disc({1, 1}, rim_to_center_ratio);
  for (int i = 0; i < kTriangles; ++i) {
    const auto triangle = random_triangle(random, 1.5);
    const double expected = sampled_integral(
        [&](const Eigen::Vector2d& at) {
          const double r2 = at.squaredNorm();
          return r2 < 1 ? 1 - (1 - rim_to_center_ratio) * r2 : 0;
        },
        triangle);
    EXPECT_NEAR(integral_over(disc, triangle), expected, 1e-3);
  }
}

TEST(Disc, IntegralOverTriangleOutsideDiscIsZero) {
  EXPECT_NEAR(integral_over(Disc({1, 1}, 1), {{{2, 0}, {3, 0}, {2, 50}}}), 0, 1e-14);
}

TEST(RectanglePattern, IntegralOverRandomTriangleMatchesSampling) {
  const RectanglePattern mosaic({{-1, -0.8, -0.4, 0, 7},  // covered by the next
                                 {-1, -0.8, -0.4, 0, 2},
                                 {-0.4, 0, 0.9, 0.7, -1},
                                 {0.1, -0.8, 0.9, 0, 0.5}});
  const auto value = [](const Eigen::Vector2d& at) {
    if (at.x() < -1 || at.x() > 0.9 || at.y() < -0.8 || at.y() > 0.7) return 0.0;
    if (at.y() < 0) return at.x() < -0.4 ? 2 : at.x() < 0.1 ? 0 : 0.5;
    return at.x() < -0.4 ? 0.0 : -1.0;
  };
  Random random(2);
  for (int i = 0; i < kTriangles; ++i) {
    const auto triangle = random_triangle(random, 1.3);
    EXPECT_NEAR(integral_over(mosaic, triangle), sampled_integral(value, triangle), 3e-3);
  }
}

TEST(RectanglePattern, ValueIsConstantAcrossLinesOfOtherRectangles) {
  const RectanglePattern pattern({{0, 0, 4, 4, 5}, {1, 1, 2, 2, 9}, {2, 1, 3, 2, 9}});
  const auto find = [&](double left, double top, double right, double bottom) {
    return pattern.find_constant_value_in_quadrilateral(
        {Eigen::Vector2d(left, top), {right, top}, {right, bottom}, {left, bottom}});
  };
  EXPECT_EQ(find(0.5, 2.5, 3.5, 3.5), 5) << "below the inner rectangles";
  EXPECT_EQ(find(1.5, 1.2, 2.5, 1.8), 9) << "across two with equal values";
  EXPECT_EQ(find(-2, -3, 8, -1), 0) << "outside, above all lines";
  EXPECT_EQ(find(0.5, 1.2, 1.5, 1.8), std::nullopt);
  EXPECT_EQ(find(0.5, 0.5, 3.5, 3.5), std::nullopt) << "around the inner rectangles";
  EXPECT_EQ(find(3.5, 3.5, 4.5, 3.8), std::nullopt);
}

TEST(RectanglePattern, IntegralIsExactForTrianglesWithSidesOnEdges) {
  const RectanglePattern square({{0, 0, 2, 3, 0.5}});
  EXPECT_DOUBLE_EQ(integral_over(square, {{{0, 0}, {2, 0}, {2, 3}}}), 1.5);
  EXPECT_DOUBLE_EQ(integral_over(square, {{{2, 3}, {0, 3}, {0, 0}}}), 1.5);
  EXPECT_DOUBLE_EQ(integral_over(square, {{{-9, -9}, {20, -9}, {-9, 20}}}), 3);
}

}  // namespace
}  // namespace vlp
