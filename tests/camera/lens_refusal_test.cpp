// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
// Bad parameters, pixels and points.
#include <gmock/gmock.h>

#include <stdexcept>

#include "camera/random_lens.h"

namespace vlp {
namespace {

using Eigen::Vector3d;

class LensWithInvalidInput : public testing::TestWithParam<LensModel> {};

TEST_P(LensWithInvalidInput, UnprojectReturnsNulloptForNonFinitePixels) {
  const Lens lens = plain_lens(GetParam());
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_FALSE(lens.unproject_pixel({bad, 0}));
    EXPECT_FALSE(lens.unproject_pixel({0, bad}));
  }
}

TEST_P(LensWithInvalidInput, ProjectReturnsNulloptForNonFinitePoints) {
  const Lens lens = plain_lens(GetParam());
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (int i = 0; i < 3; ++i) {
      Vector3d point(0.1, 0.2, 1);
      point(i) = bad;
      if (i == 2 && bad == kInfinity) continue;  // straight ahead for a division by z
      EXPECT_FALSE(lens.project_point(point)) << point.transpose();
      EXPECT_FALSE(lens.project_with_jacobians(point)) << point.transpose();
    }
  }
}

TEST_P(LensWithInvalidInput, ProjectAndUnprojectReturnOnlyFiniteResultsForHugeInput) {
  const Lens lens = plain_lens(GetParam());
  for (const double huge : {1e150, 1e160, 1e305, 1e308}) {
    const auto ray = lens.unproject_pixel({huge, -huge});
    EXPECT_TRUE(!ray || ray->direction.allFinite()) << huge;
    const auto pixel = lens.project_point({huge, 1, 1});
    EXPECT_TRUE(!pixel || pixel->allFinite()) << huge;
  }
}

TEST_P(LensWithInvalidInput, ProjectReturnsNulloptForCameraCenter) {
  EXPECT_FALSE(plain_lens(GetParam()).project_point(Vector3d::Zero()));
}

TEST_P(LensWithInvalidInput, ConstructorThrowsForInvalidParameters) {
  const auto good = parameters_with(GetParam(), {});
  EXPECT_NO_THROW(Lens(GetParam(), good));
  auto parameters = good;
  parameters.push_back(0);
  EXPECT_THROW(Lens(GetParam(), parameters), std::invalid_argument);
  parameters.resize(good.size() - 1);
  EXPECT_THROW(Lens(GetParam(), parameters), std::invalid_argument);
  EXPECT_THROW(Lens(GetParam(), {}), std::invalid_argument);
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      parameters = good;
      parameters[i] = bad;
      EXPECT_THROW(Lens(GetParam(), parameters), std::invalid_argument) << i;
    }
  }
  for (const std::size_t i : {0U, 1U}) {
    for (const double bad : {0.0, -520.0}) {
      parameters = good;
      parameters[i] = bad;
      EXPECT_THROW(Lens(GetParam(), parameters), std::invalid_argument) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, LensWithInvalidInput, testing::ValuesIn(kEveryModel),
                         testing::PrintToStringParamName());

TEST(Lens, ConstructorExceptionStatesExpectedAndGivenParameterCount) {
  const std::vector<double> parameters(9, 1.0);
  EXPECT_THAT([&] { Lens(LensModel::opencv8, parameters); },
              testing::ThrowsMessage<std::invalid_argument>(
                  testing::AllOf(testing::HasSubstr("LENSMODEL_OPENCV8"), testing::HasSubstr("12"),
                                 testing::HasSubstr("9"))));
}

TEST(Lens, ProjectsPointsBehindCameraForWideModelsOnly) {
  for (const LensModel model : kEveryModel) {
    const Lens lens = plain_lens(model);
    if (is_splined_lens_model(model)) continue;  // as far as their control points go
    const bool all_round = model == LensModel::stereographic || model == LensModel::fisheye;
    for (const Vector3d& point : {Vector3d(0.1, 0.2, -1), Vector3d(1, 0, 0), Vector3d(1, 2, -1)}) {
      EXPECT_EQ(lens.project_point(point).has_value(), all_round) << lens_model_name(model);
      EXPECT_EQ(lens.project_with_jacobians(point).has_value(), all_round)
          << lens_model_name(model);
    }
    EXPECT_FALSE(lens.project_point({0, 0, -1})) << lens_model_name(model);
  }
}

}  // namespace
}  // namespace vlp
