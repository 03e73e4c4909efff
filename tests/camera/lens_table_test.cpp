// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "camera/lens_table.h"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "camera/lens.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using testing::ElementsAre;

std::vector<std::string_view> names_of(LensModel model) {
  std::vector<std::string_view> names;
  for (const LensDistortion& distortion : list_distortions(model)) names.push_back(distortion.name);
  return names;
}

TEST(ListLensModels, ReturnsModelsInOrderOfEnumeration) {
  ASSERT_FALSE(list_lens_models().empty());
  for (std::size_t i = 0; i < list_lens_models().size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(list_lens_models()[i].model), i);
  }
}

TEST(ListDistortions, ReturnsNamesInParameterOrder) {
  EXPECT_THAT(names_of(LensModel::stereographic), ElementsAre());
  EXPECT_THAT(names_of(LensModel::opencv5), ElementsAre("k1", "k2", "p1", "p2", "k3"));
  EXPECT_THAT(names_of(LensModel::fisheye), ElementsAre("k1", "k2", "k3", "k4"));
  EXPECT_THAT(names_of(lens_model_from_name(
                           "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=16_Ny=14_fov_x_deg=190")
                           .value()),
              ElementsAre());
}

TEST(ListDistortions, FisheyeInitialValuesProjectNearlyStereographically) {
  std::vector<double> parameters{400, 400, 320, 240};
  const Lens stereographic(LensModel::stereographic, parameters);
  for (const LensDistortion& distortion : list_distortions(LensModel::fisheye)) {
    parameters.push_back(distortion.start);
  }
  const Lens fisheye(LensModel::fisheye, parameters);
  for (const double angle_rad : {0.1, 0.5, 1.0}) {
    const Eigen::Vector3d ray(std::sin(angle_rad), 0, std::cos(angle_rad));
    // What the series leaves out at one radian.
    EXPECT_THAT(fisheye.project_point(ray).value(),
                IsNear(stereographic.project_point(ray).value(), 0.01));
  }
}

}  // namespace
}  // namespace vlp
