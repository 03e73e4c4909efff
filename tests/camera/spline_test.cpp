// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Splined lenses of 190 degrees, compared with mrcal, and their limits.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numbers>

#include "camera/random_lens.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d ray_of(const Vector2d& u) { return {u.x(), u.y(), 1 - u.squaredNorm() / 4}; }

class SplinedLens : public testing::TestWithParam<LensModel> {
 protected:
  Random random_{61};
  const SplineGrid grid_ = spline_grid_of(GetParam());
  const std::vector<double> parameters_ = splined_parameters(grid_, 0.01, random_);
  const Lens lens_{GetParam(), parameters_};
  const Vector2d reach_ =
      SplineSurface(grid_, std::span(parameters_).subspan(4)).spline_half_extent();

  Vector2d random_position() {
    const double y = random_.uniform(-1, 1), x = random_.uniform(-1, 1);
    return reach_.cwiseProduct(Vector2d(x, y));
  }
};

TEST_P(SplinedLens, ProjectAndUnprojectMatchMrcalOverAllControlPoints) {
  const MrcalOracle oracle = make_oracle(GetParam(), parameters_);
  std::vector<Vector3d> rays;
  std::vector<Vector2d> pixels;
  for (int trial = 0; trial < 3000; ++trial) {
    rays.emplace_back(random_.uniform(1, 5) * ray_of(random_position()));
    pixels.push_back(lens_.project_point(rays.back()).value());
  }
  const auto expected = oracle.project(rays);
  const auto seen = oracle.unproject(pixels);
  int compared = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_THAT(pixels[i], IsNear(expected[i], 1e-9));
    const auto ray = lens_.unproject_pixel(pixels[i]);
    ASSERT_TRUE(ray) << rays[i].transpose();
    ASSERT_LT(angle_rad(ray->direction, rays[i]), 1e-10);
    ASSERT_THAT(lens_.project_point(ray->direction).value(), IsNear(pixels[i], 1e-8));
    // mrcal stops near 1e-7 px, or somewhere else.
    const auto back = lens_.project_point(seen[i]);
    if (!back || (*back - pixels[i]).norm() > 1e-6) continue;
    ++compared;
    ASSERT_LT(angle_rad(ray->direction, seen[i]), 1e-7);
  }
  EXPECT_GT(compared, 2700);
}

TEST_P(SplinedLens, ProjectReturnsNulloptOnlyBeyondEdgeOfSplineGrid) {
  const double edge_rad = grid_.fov_x_deg / 2.0 * std::numbers::pi / 180;
  EXPECT_NEAR(reach_.x(), 2 * std::tan(edge_rad / 2), 1e-12);
  EXPECT_NEAR(reach_.y() / reach_.x(), double(grid_.ny - grid_.order) / (grid_.nx - grid_.order),
              1e-12);
  for (const double fraction : {-1.0, -0.3, 0.0, 0.7, 1.0}) {
    for (const double sign : {-1.0, 1.0}) {
      const Vector2d at_side(sign * reach_.x(), fraction * reach_.y() * (1 - 1e-9));
      const Vector2d at_top(fraction * reach_.x() * (1 - 1e-9), sign * reach_.y());
      for (const Vector2d& edge : {at_side, at_top}) {
        const auto pixel = lens_.project_point(ray_of((1 - 1e-9) * edge));
        ASSERT_TRUE(pixel) << edge.transpose();
        EXPECT_TRUE(lens_.unproject_pixel(*pixel)) << edge.transpose();
        EXPECT_FALSE(lens_.project_point(ray_of((1 + 1e-9) * edge)));
        EXPECT_FALSE(lens_.project_with_jacobians(ray_of((1 + 1e-9) * edge)));
        EXPECT_FALSE(lens_.differentiate_intrinsics(ray_of((1 + 1e-9) * edge)));
      }
    }
  }
}

TEST_P(SplinedLens, UnprojectReturnsInverseOfProjectOrNullopt) {
  int rays = 0, refused = 0;
  for (double v = -1200; v <= 1800; v += 29) {
    for (double x = -1200; x <= 2000; x += 29) {
      const auto ray = lens_.unproject_pixel({x, v});
      if (!ray) {
        ++refused;
        continue;
      }
      ++rays;
      const auto back = lens_.project_point(ray->direction);
      ASSERT_TRUE(back) << x << ", " << v;
      ASSERT_THAT(*back, IsNear(Vector2d(x, v), 1e-8));
    }
  }
  EXPECT_GT(rays, 1000);
  EXPECT_GT(refused, 1000);
}

TEST_P(SplinedLens, CopyProjectsToSamePixels) {
  const Lens copy = lens_;
  const Vector3d ray = ray_of(random_position());
  EXPECT_EQ(copy.project_point(ray), lens_.project_point(ray));
  EXPECT_EQ(copy.lens_model(), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Grids, SplinedLens, testing::Values(kCubic, kQuadratic),
                         [](const auto& test) {
                           return test.param == kCubic ? "Cubic" : "Quadratic";
                         });

TEST(SplinedLensWithRandomControlPoints, UnprojectReturnsRaysOnlyWithoutFold) {
  Random random(62);
  int rays = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const LensModel model = splined_lens_model({3, 12, 10, 120});
    const Lens lens(model, splined_parameters(spline_grid_of(model), 0.4, random));
    for (double v = -300; v <= 900; v += 37) {
      for (double x = -300; x <= 1100; x += 37) {
        const auto ray = lens.unproject_pixel({x, v});
        if (!ray) continue;
        ++rays;
        const auto back = lens.project_with_jacobians(ray->direction);
        ASSERT_TRUE(back);
        ASSERT_THAT(back->pixel, IsNear(Vector2d(x, v), 1e-7));
        ASSERT_GT(ray->d_direction_d_pixel.topRows<2>().determinant(), 0);
      }
    }
  }
  EXPECT_GT(rays, 1000);
}

TEST(SplinedLensWithExtremeControlPoints, ProjectAndUnprojectReturnOnlyFiniteResults) {
  const LensModel model = splined_lens_model({3, 5, 4, 90});
  std::vector<std::vector<double>> lenses;
  for (const double all : {0.0, -1.0, 1e150, -1e300}) {
    lenses.emplace_back(num_lens_parameters(model), all);
  }
  Random random(63);
  for (int trial = 0; trial < 20; ++trial) {
    for (double& value : lenses.emplace_back(num_lens_parameters(model))) {
      value = random.uniform(-1e3, 1e3);
    }
  }
  for (std::vector<double>& parameters : lenses) {
    std::fill_n(parameters.begin(), 4, 500);
    const Lens lens(model, parameters);
    for (const double pixel : {-1e9, 0.0, 500.0, 1e300}) {
      const auto ray = lens.unproject_pixel({pixel, 500});
      EXPECT_TRUE(!ray || ray->direction.allFinite());
    }
    const auto seen = lens.project_point({0.1, 0.1, 1});
    EXPECT_TRUE(!seen || seen->allFinite());
  }
}

}  // namespace
}  // namespace vlp
