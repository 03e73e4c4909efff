// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
// What the lens refuses: the safeguard against the rays that a polynomial invents beyond the
// radius at which it folds.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "camera/distortion.h"
#include "camera/random_lens.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct FoldedLens {
  const char* name;
  std::vector<double> distortion;
};

// For GoogleTest.
void PrintTo(const FoldedLens& lens, std::ostream* out) { *out << lens.name; }

const FoldedLens kFoldedLenses[] = {
    {"Barrel", {-0.4, 0, 0, 0}},
    {"MildBarrel", {-0.25, 0.02, 0, 0}},
    {"PincushionThatFoldsLater", {0.3, -0.2, 0, 0}},
    {"DecenteredBarrel", {-0.4, 0, 0.01, -0.008}},
    {"Rational", {-0.5, 0, 1e-3, 2e-3, 0, 0.3, 0.1, 0.02}},
    {"PoleAhead", {0.2, 0, 0, 0, 0, -0.3, 0, 0}},
    {"Prism", {-0.3, 0.02, 1e-3, 1e-3, 0, 0, 0, 0, 0.02, -0.01, 0.02, 0.005}},
    {"StrongBarrel", {-1.5, 0.4, 0, 0}}};

class FoldingLens : public testing::TestWithParam<FoldedLens> {
 protected:
  static LensModel model() {
    switch (GetParam().distortion.size()) {
      case 4:
        return LensModel::opencv4;
      case 8:
        return LensModel::opencv8;
      default:
        return LensModel::opencv12;
    }
  }
  static Distortion distortion() {
    Distortion result;
    std::copy(GetParam().distortion.begin(), GetParam().distortion.end(), result.k.begin());
    return result;
  }
  const Lens lens_{model(), parameters_with(model(), GetParam().distortion)};
  const double valid_radius_ = distortion().compute_max_radius();
};

TEST_P(FoldingLens, UnprojectReturnsValidRayOrNulloptInAndAroundImage) {
  int rays = 0, refused = 0;
  for (double v = -600; v <= 1200; v += 14) {
    for (double u = -800; u <= 1600; u += 14) {
      const auto ray = lens_.unproject_pixel({u, v});
      if (!ray) {
        ++refused;
        continue;
      }
      ++rays;
      ASSERT_EQ(ray->direction.z(), 1);
      ASSERT_LE(ray->direction.head<2>().norm(), valid_radius_);
      const auto back = lens_.project_point(ray->direction);
      ASSERT_TRUE(back) << u << ", " << v;
      ASSERT_THAT(*back, IsNear(Vector2d(u, v), 1e-9));
    }
  }
  // Every lens of the list sees something, and all but the one with a pole leave pixels dark.
  EXPECT_GT(rays, 100);
  EXPECT_EQ(refused > 100, GetParam().name != std::string("PoleAhead"));
}

TEST_P(FoldingLens, UnprojectInvertsProjectUpToFold) {
  Random random(31);
  for (int trial = 0; trial < 3000; ++trial) {
    const double radius = valid_radius_ * std::sqrt(random.uniform(0, 0.999));
    const double around_rad = random.uniform(-4, 4);
    const Vector3d point(radius * std::cos(around_rad), radius * std::sin(around_rad), 1);
    const auto pixel = lens_.project_point(point);
    ASSERT_TRUE(pixel) << point.transpose();
    const auto ray = lens_.unproject_pixel(*pixel);
    ASSERT_TRUE(ray) << point.transpose();
    // Near the fold 1e-3 of a radius of pixel holds all rays; rounding is amplified as much.
    ASSERT_THAT(ray->direction, IsNear(point, 1e-10)) << point.transpose();
  }
}

TEST_P(FoldingLens, ProjectReturnsNulloptBeyondFold) {
  for (double around_rad = 0; around_rad < 6.3; around_rad += 0.1) {
    const Vector2d direction(std::cos(around_rad), std::sin(around_rad));
    const auto at = [&](double radius) -> Vector3d { return (radius * direction).homogeneous(); };
    EXPECT_TRUE(lens_.project_point(at(valid_radius_ * (1 - 1e-9))));
    EXPECT_FALSE(lens_.project_point(at(valid_radius_ * (1 + 1e-9))));
    EXPECT_FALSE(lens_.project_with_jacobians(at(valid_radius_ * 3)));
  }
}

INSTANTIATE_TEST_SUITE_P(Lenses, FoldingLens, testing::ValuesIn(kFoldedLenses),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(UnprojectPixel, ReturnsNulloptOnlyBeyondFoldOfBarrelLens) {
  // r (1 - 0.4 r^2) is largest at r = 1 / sqrt(1.2), where it is two thirds of r.
  const Lens lens(LensModel::opencv4, parameters_with(LensModel::opencv4, {-0.4}));
  const double edge_px = 520 * 2 / 3.0 / std::sqrt(1.2);
  for (double around_rad = 0; around_rad < 6.3; around_rad += 0.01) {
    const Vector2d direction(std::cos(around_rad), std::sin(around_rad));
    for (const double fraction : {0.1, 0.9, 0.999, 1 - 1e-6, 1 - 1e-9}) {
      EXPECT_TRUE(lens.unproject_pixel(lens.principal_point_px() + fraction * edge_px * direction))
          << fraction;
    }
    for (const double fraction : {1 + 1e-9, 1 + 1e-6, 1.001, 1.1, 2.0, 10.0, 1e6}) {
      EXPECT_FALSE(lens.unproject_pixel(lens.principal_point_px() + fraction * edge_px * direction))
          << fraction;
    }
  }
}

TEST(UnprojectPixel, ReturnsTrueRayIfInitialGuessLiesBeyondLaterFold) {
  // No fold up to r = 10, but one at 12.9, behind which 'distorted' lies as a first guess.
  const Lens lens(LensModel::opencv4,
                  parameters_with(LensModel::opencv4, {0.277, -1e-3, -9e-3, -8e-3}));
  for (double radius = 0.5; radius < 9.9; radius += 0.1) {
    const Vector3d point(0.6 * radius, -0.8 * radius, 1);
    const auto ray = lens.unproject_pixel(lens.project_point(point).value());
    ASSERT_TRUE(ray) << radius;
    EXPECT_THAT(ray->direction, IsNear(point, 1e-12));
  }
}

}  // namespace
}  // namespace vlp
