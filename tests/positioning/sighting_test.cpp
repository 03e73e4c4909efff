// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/sighting.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

TEST(ProjectLampToNormalizedPoint, MatchesProjectionOfLampInLevelFrame) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Pose pose{{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(0, 1)},
                    random.uniform(-3, 3)};
    const Eigen::Vector3d lamp(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(2, 4));
    const Eigen::Vector3d x_in_level = level_point_from_world(pose, lamp);
    EXPECT_THAT(project_lamp_to_normalized_point(LevelPose(pose), lamp),
                IsNear(x_in_level.hnormalized(), 1e-14));
  }
}

}  // namespace
}  // namespace vlp
