// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Corners in noisy images compared with the optimum of the model by numeric derivatives, and
/// limits of the fit.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "detection/boards/edge_crossing.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Parameters: corner (2), angles (2), blur, middle, contrast, light (2), curvatures (2), growth of
/// the squares between edges with distances of different signs.
using Parameters = Eigen::Matrix<double, 12, 1>;

double compute_gray_level(const Parameters& p, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d at = pixel - p.head<2>();
  double inside = 1, opposite = 1;
  for (const Eigen::Index i : {0, 1}) {
    const double c = std::cos(p[2 + i]), s = std::sin(p[2 + i]);
    const double u = c * at.x() + s * at.y(), v = c * at.y() - s * at.x();
    const double distance = v - p[9 + i] * u * u, scale = std::numbers::sqrt2 * p[4];
    inside *= (1 + std::erf((distance - p[11]) / scale)) / 2;
    opposite *= (1 + std::erf((-distance - p[11]) / scale)) / 2;
  }
  return (p[5] + p[6] * (2 * (inside + opposite) - 1)) * (1 + p[7] * at.x() + p[8] * at.y());
}

cv::Mat1b render_image(const Parameters& p, double noise = 0, cv::Size size = {41, 41}) {
  std::mt19937 generator(4);
  std::normal_distribution<double> normal(0, 1);
  cv::Mat1b image(size);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      image(row, column) = cv::saturate_cast<uchar>(compute_gray_level(p, {column, row}) +
                                                    noise * normal(generator));
    }
  }
  return image;
}

Parameters make_parameters() {
  Parameters p;
  p << 20.2, 19.7, 0.35, 1.62, 0.95, 120, -60, 0.012, -0.008, 0.006, -0.009, 0.15;
  return p;
}

std::array<Eigen::Vector2d, 2> directions(const Parameters& p) {
  return {Eigen::Vector2d(std::cos(p[2]), std::sin(p[2])),
          Eigen::Vector2d(std::cos(p[3]), std::sin(p[3]))};
}

/// Minimizes the residuals within a radius by Gauss-Newton steps with numeric derivatives.
Parameters minimize(const cv::Mat1b& image, const Eigen::Vector2d& guess_px, double radius_px,
                    Parameters p) {
  constexpr double h = 1e-5;
  for (int iteration = 0; iteration < 12; ++iteration) {
    Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
    Parameters right = Parameters::Zero();
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        const Eigen::Vector2d pixel(column, row);
        if ((pixel - guess_px).norm() > radius_px) continue;
        Parameters gradient;
        for (Eigen::Index i = 0; i < 12; ++i) {
          const Parameters step = h * Parameters::Unit(i);
          gradient[i] =
              (compute_gray_level(p + step, pixel) - compute_gray_level(p - step, pixel)) / (2 * h);
        }
        normal += gradient * gradient.transpose();
        right += gradient * (image(row, column) - compute_gray_level(p, pixel));
      }
    }
    // Prior on the growth: 10 gray levels per px.
    normal(11, 11) += 100;
    right[11] -= 100 * p[11];
    p += normal.ldlt().solve(right);
  }
  return p;
}

TEST(FitEdgeIntersectionAtCorner, ReturnsLeastSquaresOptimumOfNoisyImages) {
  const Eigen::Vector2d guess_px(20.5, 19.4);
  for (const auto& [angle1, angle2, contrast] :
       {std::array{0.35, 1.62, 60.0}, {-0.4, 0.9, -70.0}, {2.1, 0.8, 50.0}, {1.2, 3.0, 60.0}}) {
    SCOPED_TRACE(angle1);
    Parameters p = make_parameters();
    p[2] = angle1;
    p[3] = angle2;
    p[6] = contrast;
    const cv::Mat1b image = render_image(p, 7);
    const auto found = fit_edge_intersection_at_corner(image, guess_px, directions(p), 7);
    ASSERT_TRUE(found);
    EXPECT_THAT(found->pixel, IsNear(minimize(image, guess_px, 7, p).head<2>(), 2e-3));
    EXPECT_GT((found->pixel - p.head<2>()).norm(), 0.005) << "affected by the noise";
  }
}

TEST(FitEdgeIntersectionAtCorner, RequiresCornerWithin1p5PixelsOfGuess) {
  const Parameters p = make_parameters();
  const cv::Mat1b image = render_image(p);
  for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1, 0), {0, 1}, {-1, 0}, {0, -1}}) {
    const auto fit = [&](double distance_px) {
      return fit_edge_intersection_at_corner(image, p.head<2>() + distance_px * direction,
                                             directions(p), 7);
    };
    ASSERT_TRUE(fit(1.45)) << direction.transpose();
    EXPECT_THAT(fit(1.45)->pixel, IsNear(p.head<2>(), 0.01));
    EXPECT_FALSE(fit(1.55)) << direction.transpose();
  }
}

TEST(FitEdgeIntersectionAtCorner, RequiresContrastOfThreeLevels) {
  const Eigen::Vector2d guess_px(20, 20);
  for (const double sign : {-1, 1}) {
    Parameters p = make_parameters();
    p[7] = p[8] = 0;
    p[6] = 3.5 * sign;
    EXPECT_TRUE(fit_edge_intersection_at_corner(render_image(p), guess_px, directions(p), 7));
    p[6] = 2.5 * sign;
    EXPECT_FALSE(fit_edge_intersection_at_corner(render_image(p), guess_px, directions(p), 7));
  }
}

TEST(FitEdgeIntersectionAtCorner, RequiresRmsBelow22PercentOfContrast) {
  Parameters p = make_parameters();
  p[6] = 50;
  const Eigen::Vector2d guess_px(20, 20);
  EXPECT_TRUE(fit_edge_intersection_at_corner(render_image(p, 9), guess_px, directions(p), 8));
  EXPECT_FALSE(fit_edge_intersection_at_corner(render_image(p, 14), guess_px, directions(p), 8));
}

TEST(FitEdgeIntersectionAtCorner, AcceptsBlurOfHalfTheRadius) {
  Parameters p = make_parameters();
  p.tail<5>().setZero();
  const Eigen::Vector2d guess_px(20, 20);
  p[4] = 2.5;
  const auto found = fit_edge_intersection_at_corner(render_image(p), guess_px, directions(p), 5);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->pixel, IsNear(p.head<2>(), 0.1));
}

/// Returns the number of pixels within a radius of a point.
int count_pixels(const Eigen::Vector2d& guess_px, double radius_px) {
  int count = 0;
  for (int row = 0; row < 41; ++row) {
    for (int column = 0; column < 41; ++column) {
      count += (Eigen::Vector2d(column, row) - guess_px).norm() <= radius_px ? 1 : 0;
    }
  }
  return count;
}

TEST(FitEdgeIntersectionAtCorner, Requires16Pixels) {
  constexpr double radius_px = 2.2;
  Parameters p = make_parameters();
  p.tail<5>().setZero();
  p.head<2>() << 20.45, 20.55;
  const cv::Mat1b image = render_image(p);
  int accepted = 0, rejected = 0;
  for (double u_px = 20.3; u_px < 20.7; u_px += 0.05) {
    for (double v_px = 20.3; v_px < 20.7; v_px += 0.05) {
      const int count = count_pixels({u_px, v_px}, radius_px);
      const bool is_found =
          fit_edge_intersection_at_corner(image, {u_px, v_px}, directions(p), radius_px)
              .has_value();
      if (count == 15) EXPECT_FALSE(is_found) << u_px << " " << v_px;
      if (count == 16) EXPECT_TRUE(is_found) << u_px << " " << v_px;
      rejected += count == 15 ? 1 : 0;
      accepted += count == 16 ? 1 : 0;
    }
  }
  EXPECT_GT(accepted, 0);
  EXPECT_GT(rejected, 0);
}

/// Returns the image of a quadratic surface with a saddle at `saddle_px`. All levels are exact in
/// single precision for multiples of 1/4 px.
cv::Mat1f make_quadratic_saddle(const Eigen::Vector2d& saddle_px, cv::Size size = {41, 41}) {
  cv::Mat1f image(size);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const double x = column - saddle_px.x(), y = row - saddle_px.y();
      image(row, column) = static_cast<float>(100 + 4 * x * x + 3 * x * y - 2 * y * y);
    }
  }
  return image;
}

/// The saddle strength is equal everywhere, so the search starts at the first pixel within the
/// reach.
TEST(FindSaddlePoint, ReturnsExactSaddleOfQuadraticSurface) {
  for (const Eigen::Vector2d& saddle_px :
       {Eigen::Vector2d(20.25, 18.5), {19.75, 19.25}, {20, 17.75}}) {
    const auto found = find_saddle_point(make_quadratic_saddle(saddle_px), {20.2, 19.8}, 1, 3);
    ASSERT_TRUE(found) << saddle_px.transpose();
    EXPECT_THAT(*found, IsNear(saddle_px, 1e-6));
  }
}

TEST(FindSaddlePoint, RequiresSaddleWithinTwoPixelsOfInitialPixel) {
  const auto find = [](double u, double v) {
    return find_saddle_point(make_quadratic_saddle({u, v}), {20, 20}, 1, 3);
  };
  // The initial pixel is (20, 19).
  EXPECT_TRUE(find(21.75, 19));
  EXPECT_FALSE(find(22.25, 19));
  EXPECT_TRUE(find(20, 17.25));
  EXPECT_FALSE(find(20, 16.75));
  EXPECT_FALSE(find(21.5, 20.5));
}

TEST(FindSaddlePoint, RequiresWindowInsideImage) {
  constexpr int radius_px = 3, last = 40;
  for (const int near : {radius_px, last - radius_px}) {
    const int outside = near == radius_px ? near - 1 : near + 1;
    for (const bool is_column : {false, true}) {
      const auto find = [&](int at) {
        const Eigen::Vector2d saddle_px =
            is_column ? Eigen::Vector2d(at, 20) : Eigen::Vector2d(20, at);
        return find_saddle_point(make_quadratic_saddle(saddle_px), saddle_px, 0, radius_px);
      };
      ASSERT_TRUE(find(near)) << near << is_column;
      EXPECT_FALSE(find(outside)) << near << is_column;
    }
  }
}

TEST(FindSaddlePoint, ReturnsNulloptForExtremumAndPlane) {
  cv::Mat1f hill(41, 41), plane(41, 41), ridge(41, 41);
  for (int row = 0; row < hill.rows; ++row) {
    for (int column = 0; column < hill.cols; ++column) {
      const float x = float(column) - 20, y = float(row) - 20;
      hill(row, column) = 200 - x * x - 2 * y * y + x * y;
      plane(row, column) = 3 * x - y;
      ridge(row, column) = 200 - 2 * (x + y) * (x + y) - x * x;
    }
  }
  for (const cv::Mat1f& image : {hill, plane, ridge}) {
    EXPECT_FALSE(find_saddle_point(image, {20, 20}, 3, 3));
  }
}

/// Adds a local saddle, symmetric about a pixel and rotated by 45 degrees for `is_diagonal`.
void add_local_saddle(cv::Mat1f& image, const Eigen::Vector2i& at, float height, bool is_diagonal) {
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const float x = float(column - at.x()), y = float(row - at.y());
      const float form = is_diagonal ? x * x - y * y : 2 * x * y;
      image(row, column) += height * form * std::exp(-(x * x + y * y) / 8);
    }
  }
}

TEST(FindSaddlePoint, ReturnsStrongestSaddleWithinReach) {
  for (const bool is_diagonal : {false, true}) {
    cv::Mat1f image(41, 61, 100.0F);
    add_local_saddle(image, {18, 21}, 5, is_diagonal);
    add_local_saddle(image, {38, 21}, 20, is_diagonal);
    const auto weak = find_saddle_point(image, {20.4, 20.6}, 4, 3);
    ASSERT_TRUE(weak);
    EXPECT_THAT(*weak, IsNear(Eigen::Vector2d(18, 21), 0.01));
    const auto strong = find_saddle_point(image, {20.4, 20.6}, 18, 3);
    ASSERT_TRUE(strong);
    EXPECT_THAT(*strong, IsNear(Eigen::Vector2d(38, 21), 0.01));
  }
}

TEST(FindSaddlePoint, SearchesCircleOfGivenRadius) {
  for (const Eigen::Vector2i& direction : {Eigen::Vector2i(1, 1), {1, -1}, {-1, -1}, {-1, 1}}) {
    cv::Mat1f image(61, 61, 100.0F);
    const Eigen::Vector2i at = Eigen::Vector2i(30, 30) + 8 * direction;
    add_local_saddle(image, at, 20, false);
    EXPECT_FALSE(find_saddle_point(image, {30, 30}, 8, 3)) << direction.transpose();
    const auto found = find_saddle_point(image, {30, 30}, 12, 3);
    ASSERT_TRUE(found) << direction.transpose();
    EXPECT_THAT(*found, IsNear(at.cast<double>(), 0.01));
  }
}

}  // namespace
}  // namespace vlp
