// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/fisheye.h"

#include <gtest/gtest.h>

#include <numbers>

#include "camera/random_lens.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Creates a lens of 190 degrees for 1000 x 1000 px.
Lens wide_lens() {
  return {LensModel::fisheye, std::array{290.0, 291.0, 501.0, 498.0, 0.03, -0.012, 0.004, -0.0006}};
}

Eigen::Vector3d ray_at(double off_axis_rad, double around_rad) {
  return {std::sin(off_axis_rad) * std::cos(around_rad),
          std::sin(off_axis_rad) * std::sin(around_rad), std::cos(off_axis_rad)};
}

TEST(FisheyeLens, ProjectMatchesPolynomialOfAngle) {
  const Lens lens = wide_lens();
  for (const double degrees : {0.001, 1.0, 45.0, 89.0, 90.0, 91.0, 95.0}) {
    const double a = degrees * kDegree;
    const double d = a + 0.03 * std::pow(a, 3) - 0.012 * std::pow(a, 5) + 0.004 * std::pow(a, 7) -
                     0.0006 * std::pow(a, 9);
    const auto pixel = lens.project_point(5 * ray_at(a, 0.7));
    ASSERT_TRUE(pixel) << degrees;
    EXPECT_THAT(*pixel, IsNear(Eigen::Vector2d(501 + 290 * d * std::cos(0.7),
                                               498 + 291 * d * std::sin(0.7)),
                               1e-10));
  }
}

TEST(FisheyeLens, UnprojectInvertsProjectBeyond90Degrees) {
  Random random(4);
  for (int trial = 0; trial < 2000; ++trial) {
    const Lens lens(LensModel::fisheye, random_parameters(LensModel::fisheye, random));
    const double off_axis_rad = random.uniform(0, 97 * kDegree);
    const Eigen::Vector3d ray = ray_at(off_axis_rad, random.uniform(-3, 3));
    const auto pixel = lens.project_point(ray);
    ASSERT_TRUE(pixel);
    const auto back = lens.unproject_pixel(*pixel);
    ASSERT_TRUE(back);
    ASSERT_LT(angle_rad(back->direction, ray), 1e-11);
    ASSERT_THAT(lens.project_point(back->direction).value(), IsNear(*pixel, 1e-8));
  }
}

TEST(FisheyeLens, JacobiansMatchDifferenceQuotientsBeyond90Degrees) {
  const Lens lens = wide_lens();
  constexpr double step = 1e-5;
  for (const double degrees : {0.01, 30.0, 89.9, 94.0}) {
    const Eigen::Vector3d point = 3 * ray_at(degrees * kDegree, 2.2);
    const auto at = lens.project_with_jacobians(point);
    ASSERT_TRUE(at);
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d off = step * Eigen::Vector3d::Unit(i);
      const Eigen::Vector2d by =
          (lens.project_point(point + off).value() - lens.project_point(point - off).value()) /
          2e-5;
      EXPECT_THAT(Eigen::Vector2d(at->d_pixel_d_point.col(i)), IsNear(by, 1e-6)) << degrees;
    }
    const auto ray = lens.unproject_pixel(at->pixel);
    ASSERT_TRUE(ray);
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d off = 1e-3 * Eigen::Vector2d::Unit(i);
      const Eigen::Vector3d by = (lens.unproject_pixel(at->pixel + off).value().direction -
                                  lens.unproject_pixel(at->pixel - off).value().direction) /
                                 2e-3;
      EXPECT_THAT(Eigen::Vector3d(ray->d_direction_d_pixel.col(i)), IsNear(by, 1e-9)) << degrees;
    }
  }
}

TEST(FisheyeLens, ProjectInvertsUnprojectUpToValidAngle) {
  for (const std::array<double, 4>& k : {std::array<double, 4>{0, 0, 0, 0},
                                         {0.03, -0.012, 0.004, -0.0006},
                                         {-0.1, 0, 0, 0},
                                         {-0.4, 0.3, 0, 0},
                                         {5, 40, 300, 1000},
                                         {-1e4, 0, 0, 0},
                                         {1e4, 0, 0, 0}}) {
    const Lens lens(LensModel::fisheye, std::array{300.0, 301.0, 0.0, 0.0, k[0], k[1], k[2], k[3]});
    const Fisheye fisheye{k};
    const double edge = fisheye.radius_from_angle(fisheye.compute_max_angle_rad());
    for (int i = 0; i <= 1000; ++i) {
      const double fraction = i < 900 ? i / 900.0 : 1 - std::pow(10.0, -2 - (i - 900) / 7.0);
      const Eigen::Vector2d pixel(300 * edge * fraction * 0.6, 301 * edge * fraction * 0.8);
      const auto ray = lens.unproject_pixel(pixel);
      ASSERT_TRUE(ray) << k[0] << " " << fraction;
      const auto back = lens.project_point(ray->direction);
      ASSERT_TRUE(back) << k[0] << " " << fraction;
      ASSERT_LT((*back - pixel).norm(), 1e-8 * std::max(1.0, edge)) << k[0] << " " << fraction;
    }
  }
}

TEST(FisheyeLens, ReturnsNulloptForRaysAndPixelsBeyondFold) {
  const Fisheye fisheye{{-0.1, 0, 0, 0}};  // d' = 1 - 0.3 a^2
  const double fold_rad = std::sqrt(1 / 0.3);
  EXPECT_NEAR(fisheye.compute_max_angle_rad(), fold_rad, 1e-12);
  const Lens lens(LensModel::fisheye, std::array{300.0, 300.0, 400.0, 300.0, -0.1, 0.0, 0.0, 0.0});
  EXPECT_TRUE(lens.project_point(ray_at(fold_rad - 1e-6, 1)));
  EXPECT_FALSE(lens.project_point(ray_at(fold_rad + 1e-6, 1)));
  const double edge_px = 300 * fisheye.radius_from_angle(fold_rad);
  EXPECT_TRUE(lens.unproject_pixel({400 + edge_px - 1e-3, 300}));
  EXPECT_FALSE(lens.unproject_pixel({400 + edge_px + 1e-3, 300}));
  EXPECT_EQ(Fisheye{}.compute_max_angle_rad(), std::numbers::pi);
}

}  // namespace
}  // namespace vlp
