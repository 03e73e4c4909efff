// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/light_center.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "geometry/circle_fit.h"
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
      : shape(camera), center_px(shape.pixel_from_plane(circle.center).value()) {}

  /// Returns the rim with each point at its position when its scanline is read: at d + m (l - l_c).
  std::vector<Vector2d> outline(const Vector2d& motion_per_line) const {
    constexpr int count = 120;
    std::vector<Vector2d> points;
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const Vector2d rim =
          circle.center + circle.radius * Vector2d(std::cos(angle), std::sin(angle));
      Vector2d pixel = shape.pixel_from_plane(rim).value();
      for (int iteration = 0; iteration < 20; ++iteration) {
        pixel = shape.pixel_from_plane(rim + (pixel.y() - center_px.y()) * motion_per_line).value();
      }
      points.push_back(pixel);
    }
    return points;
  }

  /// Fits a circle to the rim, and the normal equations for its ovality.
  std::optional<MeasuredLight> fit_light(const Vector2d& motion_per_line) const {
    std::vector<Vector2d> in_plane;
    for (const Vector2d& pixel : outline(motion_per_line))
      in_plane.push_back(shape.plane_from_pixel(pixel).value());
    const auto fit = fit_circle(in_plane);
    MeasuredLight light{};
    if (!fit || !shape.set_outline({fit->circle.center, Matrix2::Identity() / fit->circle.radius},
                                   600 * fit->circle.radius, light))
      return std::nullopt;
    light.outline_equations = make_outline_equations(
        in_plane, fit->circle, shape.compute_scanline_gradient(fit->circle), 1e-3);
    return light;
  }

  static constexpr std::array kIntrinsics{600.0, 600.0, 399.5, 299.5, -0.3, 0.1, 0.0, 0.0};
  DetectorCamera camera{Readout::rows, 3e-5, Lens(LensModel::opencv4, kIntrinsics)};
  LightShape shape;
  Circle circle{{0.35, 0.3}, 0.12};
  Vector2d center_px;
};

TEST_F(LightShapeOfMovingDisc, CorrectedCenterMatchesPositionAtReadoutOfCenterRow) {
  // A lamp 2.5 m above a camera that moves at 2 m/s, with a row time of 30 us.
  for (const Vector2d& motion :
       {Vector2d(2.4e-5, 0), Vector2d(0, 2.4e-5), Vector2d(-1.5e-5, 2e-5)}) {
    auto light = fit_light(motion);
    ASSERT_TRUE(light);
    const Vector2d oval = complex_product(light->outline_equations->scanline_gradient, motion) / 2;
    MeasuredLight unshifted = *light;
    shape.correct_center_for_motion({oval, 1e-12 * Matrix2::Identity()}, motion, *light);
    shape.correct_center_for_motion({oval, 1e-12 * Matrix2::Identity()}, Vector2d::Zero(),
                                    unshifted);
    EXPECT_THAT(light->pixel, IsNear(center_px, 2e-3));
    EXPECT_GT((unshifted.pixel - center_px).norm(), 8e-3) << "read sooner than its center";
  }
}

TEST_F(LightShapeOfMovingDisc, CorrectedCenterMatchesTrueCenterForStationaryCamera) {
  auto light = fit_light(Vector2d::Zero());
  ASSERT_TRUE(light);
  shape.correct_center_for_motion({Vector2d::Zero(), 1e-12 * Matrix2::Identity()}, Vector2d::Zero(),
                                  *light);
  EXPECT_THAT(light->pixel, IsNear(center_px, 1e-6));
}

}  // namespace
}  // namespace vlp
