// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens.h"

#include <gtest/gtest.h>

#include "camera/random_lens.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class EveryLens : public testing::TestWithParam<LensModel> {};

TEST_P(EveryLens, AccessorsReturnModelFocalLengthsAndPrincipalPoint) {
  auto parameters = parameters_with(GetParam(), {});
  parameters[1] = 530;
  const Lens lens(GetParam(), parameters);
  EXPECT_EQ(lens.lens_model(), GetParam());
  EXPECT_EQ(lens.focal_px(), Vector2d(520, 530));
  EXPECT_EQ(lens.principal_point_px(), Vector2d(399.5, 299.5));
}

TEST_P(EveryLens, ProjectsOpticalAxisToPrincipalPointAndBack) {
  const Lens lens = plain_lens(GetParam());
  EXPECT_EQ(lens.project_point({0, 0, 2}), lens.principal_point_px());
  const auto ray = lens.unproject_pixel(lens.principal_point_px());
  ASSERT_TRUE(ray);
  EXPECT_EQ(ray->direction, Vector3d::UnitZ());
}

TEST_P(EveryLens, ProjectInvertsUnproject) {
  Random random(21);
  for (int trial = 0; trial < 2000; ++trial) {
    const Lens lens(GetParam(), random_parameters(GetParam(), random));
    const Vector2d pixel(random.uniform(200, 600), random.uniform(100, 500));
    const auto ray = lens.unproject_pixel(pixel);
    ASSERT_TRUE(ray);
    const auto back = lens.project_point(ray->direction);
    ASSERT_TRUE(back);
    ASSERT_THAT(*back, IsNear(pixel, 1e-9));
  }
}

TEST_P(EveryLens, UnprojectInvertsProject) {
  Random random(22);
  for (int trial = 0; trial < 2000; ++trial) {
    const Lens lens(GetParam(), random_parameters(GetParam(), random));
    const Vector3d point = random_point(random);
    const auto pixel = lens.project_point(point);
    ASSERT_TRUE(pixel);
    const auto ray = lens.unproject_pixel(*pixel);
    ASSERT_TRUE(ray);
    ASSERT_LT(angle_rad(ray->direction, point), 1e-12);
  }
}

TEST_P(EveryLens, ProjectIsIndependentOfDistance) {
  Random random(23);
  const Lens lens(GetParam(), random_parameters(GetParam(), random));
  const Vector3d point = random_point(random);
  for (const double factor : {1e-9, 1e-3, 1e3, 1e9}) {
    EXPECT_THAT(lens.project_point(factor * point).value(),
                IsNear(lens.project_point(point).value(), 1e-10));
  }
}

INSTANTIATE_TEST_SUITE_P(Models, EveryLens, testing::ValuesIn(kEveryModel),
                         testing::PrintToStringParamName());

TEST(Lens, UnprojectsStereographicRaysBehindCamera) {
  const Lens lens = plain_lens(LensModel::stereographic);
  const Vector3d point(1, -2, -3);
  const auto ray = lens.unproject_pixel(lens.project_point(point).value());
  ASSERT_TRUE(ray);
  EXPECT_LT(ray->direction.z(), 0);
  EXPECT_LT(angle_rad(ray->direction, point), 1e-14);
}

}  // namespace
}  // namespace vlp
