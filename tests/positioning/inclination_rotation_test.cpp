// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/inclination_rotation.h"

#include <gtest/gtest.h>

#include "support/matchers.h"

namespace vlp {
namespace {

TEST(ComputeInclinationRotation, RollAndPitchErrorAxesMatchFiniteDifferences) {
  constexpr double step = 1e-5, yaw_rad = 0.6;
  const Inclination inclination{0.2, -0.3};
  const InclinationRotation found = compute_inclination_rotation(inclination, yaw_rad);
  const Eigen::Matrix3d robot_from_base = rotation_about_z(yaw_rad);
  EXPECT_THAT(found.level_from_base,
              IsNear((robot_from_base.transpose() * level_rotation_from_inclination(inclination) *
                      robot_from_base)
                         .eval(),
                     1e-15));
  for (const int axis : {0, 1}) {
    Inclination more = inclination, less = inclination;
    (axis == 0 ? more.roll_rad : more.pitch_rad) += step;
    (axis == 0 ? less.roll_rad : less.pitch_rad) -= step;
    const Eigen::Matrix3d rotation = (compute_inclination_rotation(more, yaw_rad).level_from_base -
                                      compute_inclination_rotation(less, yaw_rad).level_from_base) /
                                     (2 * step) * found.level_from_base.transpose();
    const Eigen::Vector3d rotation_axis(rotation(2, 1), rotation(0, 2), rotation(1, 0));
    EXPECT_THAT(Eigen::Vector3d(found.error_axes.col(axis)), IsNear(rotation_axis, 1e-9));
  }
}

}  // namespace
}  // namespace vlp
