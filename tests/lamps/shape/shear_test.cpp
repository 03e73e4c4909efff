// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/shape/shear.h"

#include <gtest/gtest.h>

#include <numbers>

#include "geometry/arc.h"
#include "geometry/circle_fit.h"
#include "lamps/shape/outline_equations.h"
#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

/// Line slope of a level camera with a focal length of 600 px: scanlines per unit of the level
/// plane.
const Vector2d kLineSlope(0, 600);
constexpr double kRadius = 0.08;

/// Returns the rim of a disc as a rolling shutter records it. The center moves by `motion` per
/// scanline.
Points read_line_by_line(Points points, const Vector2d& center, const Vector2d& motion) {
  for (Vector2d& point : points) point += motion * kLineSlope.dot(point - center);
  return points;
}

/// Camera that translates and rotates, and the outlines of lights that it records.
class MovingCamera {
 public:
  Vector2d motion_at(const Vector2d& center) const {
    return v + w * Vector2d(-center.y(), center.x());
  }
  OutlineEquations make_outline(const Vector2d& center, double angle_rad, Random& random) const {
    Points points = read_line_by_line(arc({center, kRadius}, 0.4, 0.4 + angle_rad, 90), center,
                                      motion_at(center));
    for (Vector2d& point : points) point += noise * Vector2d(random.normal(), random.normal());
    return make_outline_equations(points, fit_circle(points)->circle, kLineSlope, noise / kRadius);
  }

  Vector2d v{2.0e-5, -1.5e-5};
  double w = 3e-5;
  double noise = 1e-4;
};

std::vector<OutlineEquations> three_whole(const MovingCamera& moving_camera, Random& random) {
  return {moving_camera.make_outline({0.4, 0.3}, 2 * pi, random),
          moving_camera.make_outline({-0.4, 0.2}, 2 * pi, random),
          moving_camera.make_outline({0.1, -0.4}, 2 * pi, random)};
}

TEST(Shear, PredictedOvalMatchesMotionOfTranslatingAndRotatingCamera) {
  Random random(1);
  const MovingCamera moving_camera;
  const auto lights = three_whole(moving_camera, random);
  const auto shear = Shear::estimate_shear(lights);
  ASSERT_TRUE(shear);
  const Vector2d at(-0.3, -0.3);
  const Oval oval = shear->predict_oval(moving_camera.make_outline(at, 2 * pi, random));
  // With s along y alone, s (v_x + i v_y) / 2 is |s| (-v_y + i v_x) / 2.
  const Vector2d motion = moving_camera.motion_at(at),
                 expected = 300 * Vector2d(-motion.y(), motion.x());
  EXPECT_GT(expected.norm(), 0.005);
  EXPECT_THAT(oval.oval, IsNear(expected, 3e-4));
  EXPECT_THAT(shear->motion_per_line(moving_camera.make_outline(at, 2 * pi, random)),
              IsNear(motion, 1e-6));
}

TEST(Shear, ReducesCenterErrorOfPartialOutline) {
  Random random(2);
  const MovingCamera moving_camera;
  const Vector2d center(-0.3, -0.3);
  double squared = 0, circle_squared = 0, chi_square = 0;
  constexpr int trials = 100;
  for (int trial = 0; trial < trials; ++trial) {
    auto lights = three_whole(moving_camera, random);
    lights.push_back(moving_camera.make_outline(center, 1.1 * pi, random));
    const OutlineEquations& part = lights.back();
    const auto shear = Shear::estimate_shear(lights);
    ASSERT_TRUE(shear);
    const auto found = part.solve_with_oval_prior(shear->predict_oval(part));
    ASSERT_TRUE(found);
    const Vector2d by_circle = part.circle.center - center;
    const Vector2d error = (by_circle + kRadius * found->p.head<2>()) / kRadius;
    squared += error.squaredNorm() / trials;
    circle_squared += by_circle.squaredNorm() / (kRadius * kRadius) / trials;
    chi_square +=
        error.dot(found->covariance.topLeftCorner<2, 2>().inverse() * error) / (2 * trials);
  }
  EXPECT_LT(std::sqrt(squared), 0.15 * std::sqrt(circle_squared));
  // The error allowed for lamps at other heights, which these lamps do not have, is included.
  EXPECT_GT(chi_square, 0.1);
  EXPECT_LT(chi_square, 1.3);
}

TEST(Shear, EstimateIgnoresLightWithContradictingMotion) {
  Random random(4);
  const MovingCamera moving_camera;
  auto lights = three_whole(moving_camera, random);
  MovingCamera other;
  other.v = -3 * moving_camera.v;
  lights.push_back(other.make_outline({0.4, -0.3}, 2 * pi, random));
  const auto shear = Shear::estimate_shear(lights);
  ASSERT_TRUE(shear);
  const Vector2d motion = moving_camera.motion_at({-0.4, 0.2});
  EXPECT_THAT(shear->predict_oval(lights[1]).oval,
              IsNear(300 * Vector2d(-motion.y(), motion.x()), 5e-4));
}

}  // namespace
}  // namespace vlp
