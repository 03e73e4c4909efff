// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/light_center.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "geometry/plane.h"
#include "lamps/shape/outline_equations.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

/// Moving disc off the image center, with a lens that distorts scanlines.
class LightShapeOfMovingDisc : public testing::Test {
 protected:
  LightShapeOfMovingDisc()
      : shape(camera), center_px(shape.pixel_from_level_plane_point(circle.center).value()) {}

  /// Returns the rim with each point at its position when its scanline is read: at d + m (l - l_c).
  std::vector<EdgePoint> outline(const Vector2d& motion_per_line) const {
    constexpr int count = 120;
    std::vector<EdgePoint> points;
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const Vector2d rim =
          circle.center + circle.radius * Vector2d(std::cos(angle), std::sin(angle));
      Vector2d pixel = shape.pixel_from_level_plane_point(rim).value();
      for (int iteration = 0; iteration < 20; ++iteration) {
        pixel =
            shape.pixel_from_level_plane_point(rim + (pixel.y() - center_px.y()) * motion_per_line)
                .value();
      }
      points.push_back({pixel, 100, 1, pixel.x() < center_px.x()});
    }
    return points;
  }

  /// Fits a circle to the rim, and the normal equations for its ovality.
  std::optional<Light> fit_light(const Vector2d& motion_per_line) const {
    const auto points = outline(motion_per_line);
    auto light = shape.fit_light_to_outline(points, dark);
    if (!light) return light;
    std::vector<Vector2d> in_plane;
    for (const EdgePoint& point : points)
      in_plane.push_back(shape.level_plane_point_from_pixel(point.pixel).value());
    const Circle fitted{light->plane_outline.center, light->plane_outline.radius()};
    light->outline_equations = make_outline_equations(
        in_plane, fitted, shape.compute_scanline_gradient_wrt_position(fitted), 1e-3);
    return light;
  }

  static constexpr std::array kIntrinsics{600.0, 600.0, 399.5, 299.5, -0.3, 0.1, 0.0, 0.0};
  DetectorCamera camera{Readout::rows, 3e-5, Lens(LensModel::opencv4, kIntrinsics)};
  LightShape shape;
  Circle circle{{0.35, 0.3}, 0.12};
  Vector2d center_px;
  Background dark{0, 1, 5};
};

TEST_F(LightShapeOfMovingDisc, CorrectedCenterMatchesPositionAtReadoutOfCenterRow) {
  // A lamp 2.5 m above a camera that moves at 2 m/s, with a row time of 30 us.
  for (const Vector2d& motion :
       {Vector2d(2.4e-5, 0), Vector2d(0, 2.4e-5), Vector2d(-1.5e-5, 2e-5)}) {
    auto light = fit_light(motion);
    ASSERT_TRUE(light);
    const Vector2d oval = complex_product(light->outline_equations->scanline_gradient, motion) / 2;
    Light unshifted = *light;
    shape.correct_light_for_motion({oval, 1e-12 * Matrix2::Identity()}, motion, *light);
    shape.correct_light_for_motion({oval, 1e-12 * Matrix2::Identity()}, Vector2d::Zero(),
                                   unshifted);
    EXPECT_THAT(light->pixel, IsNear(center_px, 2e-3));
    EXPECT_GT((unshifted.pixel - center_px).norm(), 8e-3) << "read sooner than its center";
  }
}

TEST_F(LightShapeOfMovingDisc, CorrectedCenterMatchesTrueCenterForStationaryCamera) {
  auto light = fit_light(Vector2d::Zero());
  ASSERT_TRUE(light);
  shape.correct_light_for_motion({Vector2d::Zero(), 1e-12 * Matrix2::Identity()}, Vector2d::Zero(),
                                 *light);
  EXPECT_THAT(light->pixel, IsNear(center_px, 1e-6));
}

}  // namespace
}  // namespace vlp
