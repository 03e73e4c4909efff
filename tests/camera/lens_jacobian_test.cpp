// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
// The Jacobians of the lens beside central differences.
#include <gtest/gtest.h>

#include "camera/random_lens.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr int kCameras = 40;
constexpr int kPoints = 20;

/// Runs `check(parameters, lens, point)` on random cameras and points.
template <typename Check>
void for_random_points(LensModel model, const Check& check) {
  Random random(12);
  for (int camera = 0; camera < kCameras; ++camera) {
    const auto parameters = random_parameters(model, random);
    const Lens lens(model, parameters);
    for (int i = 0; i < kPoints; ++i) check(parameters, lens, random_point(random));
  }
}

class LensJacobian : public testing::TestWithParam<LensModel> {};

// A pixel of some 1000 is rounded to 1e-13, which a step of 1e-5 makes 1e-8; the square of the
// step leaves less.
constexpr double kStep = 1e-5, kTolerance = 1e-7;

TEST_P(LensJacobian, PixelJacobianWrtPointMatchesDifferenceQuotient) {
  for_random_points(GetParam(), [](const auto&, const Lens& lens, const Eigen::Vector3d& point) {
    const auto projection = lens.project_with_jacobians(point).value();
    Eigen::Matrix<double, 2, 3> expected;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
      expected.col(i) =
          (lens.project_point(point + step).value() - lens.project_point(point - step).value()) /
          (2 * kStep);
    }
    const double scale = 1 + expected.cwiseAbs().maxCoeff();
    ASSERT_THAT(projection.d_pixel_d_point, IsNear(expected, kTolerance * scale));
  });
}

TEST_P(LensJacobian, PixelJacobianWrtParametersMatchesDifferenceQuotient) {
  const LensModel model = GetParam();
  int points = 0;
  for_random_points(model, [&](const std::vector<double>& parameters, const Lens& lens,
                               const Eigen::Vector3d& point) {
    // Hundreds of control points, each of which is a lens to be built.
    constexpr int max_points = 8;
    if (is_splined_lens_model(model) && ++points > max_points) return;
    const Eigen::Matrix2Xd jacobian = parameter_jacobian(lens, point);
    const auto pixel_with = [&](std::size_t i, double step) {
      auto changed = parameters;
      changed[i] += step;
      return Lens(model, changed).project_point(point).value();
    };
    Eigen::Matrix2Xd expected(2, std::ssize(parameters));
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      expected.col(static_cast<Eigen::Index>(i)) =
          (pixel_with(i, kStep) - pixel_with(i, -kStep)) / (2 * kStep);
    }
    const double scale = 1 + expected.cwiseAbs().maxCoeff();
    ASSERT_THAT(jacobian, IsNear(expected, kTolerance * scale));
  });
}

TEST_P(LensJacobian, RayJacobianWrtPixelMatchesDifferenceQuotient) {
  for_random_points(GetParam(), [](const auto&, const Lens& lens, const Eigen::Vector3d& point) {
    const Eigen::Vector2d pixel = lens.project_point(point).value();
    const auto ray = lens.unproject_pixel(pixel).value();
    constexpr double step_px = 1e-3;
    Eigen::Matrix<double, 3, 2> expected;
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d step = step_px * Eigen::Vector2d::Unit(i);
      expected.col(i) = (lens.unproject_pixel(pixel + step).value().direction -
                         lens.unproject_pixel(pixel - step).value().direction) /
                        (2 * step_px);
    }
    // The Jacobian is that of Newton's last but one point, up to 1e-7 of the radius away.
    const double tolerance = 1e-6 * expected.cwiseAbs().maxCoeff();
    ASSERT_THAT(ray.d_direction_d_pixel, IsNear(expected, tolerance));
  });
}

TEST_P(LensJacobian, RayJacobianInvertsPixelJacobian) {
  for_random_points(GetParam(), [](const auto&, const Lens& lens, const Eigen::Vector3d& point) {
    const auto ray = lens.unproject_pixel(lens.project_point(point).value()).value();
    const auto projection = lens.project_with_jacobians(ray.direction).value();
    ASSERT_THAT(projection.d_pixel_d_point * ray.d_direction_d_pixel,
                IsNear(Eigen::Matrix2d::Identity(), 1e-6));
  });
}

INSTANTIATE_TEST_SUITE_P(Models, LensJacobian, testing::ValuesIn(kEveryModel),
                         testing::PrintToStringParamName());

}  // namespace
}  // namespace vlp
