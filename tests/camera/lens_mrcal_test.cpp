// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
// The lens models beside mrcal's own evaluation of them.
#include <gtest/gtest.h>

#include "camera/random_lens.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr int kMrcalCameras = 100;
constexpr std::size_t kMrcalPoints = 50;

class LensAgainstMrcal : public testing::TestWithParam<LensModel> {
 protected:
  Random random_{11};

  std::vector<Eigen::Vector3d> random_points() {
    std::vector<Eigen::Vector3d> points(kMrcalPoints);
    for (auto& point : points) point = random_point(random_);
    return points;
  }
};

TEST_P(LensAgainstMrcal, ProjectMatchesPixelsOfMrcal) {
  for (int camera = 0; camera < kMrcalCameras; ++camera) {
    const auto parameters = random_parameters(GetParam(), random_);
    const Lens lens(GetParam(), parameters);
    const auto points = random_points();
    const auto expected = make_oracle(GetParam(), parameters).project(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto pixel = lens.project_point(points[i]);
      ASSERT_TRUE(pixel) << points[i].transpose();
      ASSERT_THAT(*pixel, IsNear(expected[i], 1e-8)) << points[i].transpose();
    }
  }
}

TEST_P(LensAgainstMrcal, PixelJacobiansMatchGradientsOfMrcal) {
  for (int camera = 0; camera < kMrcalCameras; ++camera) {
    const auto parameters = random_parameters(GetParam(), random_);
    const Lens lens(GetParam(), parameters);
    const MrcalOracle oracle = make_oracle(GetParam(), parameters);
    for (const auto& point : random_points()) {
      const auto projection = lens.project_with_jacobians(point);
      ASSERT_TRUE(projection);
      EXPECT_EQ(projection->pixel, lens.project_point(point));
      const auto expected = oracle.gradients(point);
      const auto rounding = [](const auto& matrix) {
        return 1e-13 * (1 + matrix.cwiseAbs().maxCoeff());
      };
      ASSERT_THAT(projection->d_pixel_d_point,
                  IsNear(expected.d_pixel_d_point, rounding(expected.d_pixel_d_point)));
      const Eigen::Matrix2Xd by_parameters = parameter_jacobian(lens, point);
      ASSERT_EQ(by_parameters.cols(), expected.d_pixel_d_parameters.cols());
      ASSERT_THAT(by_parameters,
                  IsNear(expected.d_pixel_d_parameters, rounding(expected.d_pixel_d_parameters)));
      const Eigen::Index num_dense = projection->d_pixel_d_parameters.cols();
      ASSERT_EQ(num_dense, is_splined_lens_model(GetParam()) ? 4 : by_parameters.cols());
      ASSERT_EQ(projection->d_pixel_d_parameters, by_parameters.leftCols(num_dense));
    }
  }
}

// mrcal_unproject minimizes a reprojection error. It stops when that is near 1e-7 px, which is
// more than 1e-9 rad; it may end on the second ray of a pixel, beyond the fold of the model, or
// nowhere (NaN). Those pixels are left out of the comparison, but not of the comparison with the
// points that made them.
TEST_P(LensAgainstMrcal, UnprojectMatchesRaysOfMrcal) {
  int compared = 0;
  for (int camera = 0; camera < kMrcalCameras; ++camera) {
    const auto parameters = random_parameters(GetParam(), random_);
    const Lens lens(GetParam(), parameters);
    const MrcalOracle oracle = make_oracle(GetParam(), parameters);
    const auto points = random_points();
    const auto pixels = oracle.project(points);
    const auto rays = oracle.unproject(pixels);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto ray = lens.unproject_pixel(pixels[i]);
      ASSERT_TRUE(ray) << pixels[i].transpose();
      ASSERT_LT(angle_rad(ray->direction, points[i]), 1e-9) << pixels[i].transpose();
      const auto back = lens.project_point(rays[i]);
      if (!back || !((*back - pixels[i]).norm() < 1e-8)) continue;
      ++compared;
      ASSERT_LT(angle_rad(ray->direction, rays[i]), 1e-9) << pixels[i].transpose();
    }
  }
  EXPECT_GT(compared, 0.95 * kMrcalCameras * static_cast<int>(kMrcalPoints));
}

INSTANTIATE_TEST_SUITE_P(Models, LensAgainstMrcal, testing::ValuesIn(kMrcalModels),
                         testing::PrintToStringParamName());

}  // namespace
}  // namespace vlp
