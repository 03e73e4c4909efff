// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/homography.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <vector>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

TEST(EstimateHomography, RecoversTrueHomographyFromExactPairs) {
  Eigen::Matrix3d truth;
  truth << 800, 30, 400, -20, 750, 300, 0.1, -0.2, 1;
  Random random(3);
  for (const int count : {4, 5, 20}) {
    std::vector<PlanePair> pairs;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d from(random.uniform(-1, 1), random.uniform(-1, 1));
      pairs.push_back({from, (truth * from.homogeneous()).hnormalized()});
    }
    const Eigen::Matrix3d found = estimate_homography(pairs);
    EXPECT_THAT(found / found(2, 2), IsNear(truth, 1e-8)) << count;
  }
}

}  // namespace
}  // namespace vlp
