// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/outlier_rejection.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>

#include "support/matchers.h"

namespace vlp {
namespace {

const Pose kTruth{{0.1, -0.05, 0}, 0.4};

/// Observations of lamps at two heights by a level camera at the true pose.
std::array<Sighting, 5> sightings() {
  const std::array<Eigen::Vector3d, 5> lamps_m{Eigen::Vector3d{-0.6, -0.4, 1.6},
                                               {0.6, -0.4, 1.6},
                                               {0.6, 0.4, 1.8},
                                               {-0.6, 0.4, 1.6},
                                               {0, 0.5, 1.8}};
  std::array<Sighting, 5> seen;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    seen[i] = {lamps_m[i], project_lamp_to_normalized_point(LevelPose(kTruth), lamps_m[i]),
               Matrix2::Identity(), 0.05};
  }
  return seen;
}

TEST(FindLargestConsistentLampSet, ReturnsPoseWithSmallestResidualsAmongEqualCounts) {
  auto seen = sightings();
  seen[0].z.x() += 0.004;  // the first pairs propose wrong poses
  const auto consensus = find_largest_consistent_lamp_set(seen, 0.1);
  ASSERT_TRUE(consensus);
  EXPECT_EQ(consensus->count, 5u);
  EXPECT_THAT(consensus->pose.position_m, IsNear(kTruth.position_m, 1e-12));
}

TEST(FindLargestConsistentLampSet, ReturnsNulloptWhenFewerThanThreeLampsAgree) {
  auto seen = sightings();
  seen[0].z.x() += 0.1, seen[1].z.y() -= 0.15;
  const auto consensus = find_largest_consistent_lamp_set(seen, 0.01);
  ASSERT_TRUE(consensus);
  EXPECT_EQ(consensus->inliers.to_ulong(), 0b11100u);
  EXPECT_FALSE(find_largest_consistent_lamp_set(std::span(seen).first(4), 0.01)) << "two of four";
}

TEST(EstimateAndCheckPose, ReturnsDegenerateWhenHeightSdExceedsHeight) {
  auto seen = sightings();
  for (Sighting& sighting : seen) sighting.lamp_m.z() += 2;  // all of it 2 m higher
  const ConsistentFix fix = estimate_and_check_pose(seen, 1);
  ASSERT_EQ(fix.status, FixStatus::ok);
  EXPECT_NEAR(fix.fix.pose.position_m.z(), 2, 1e-9);
  const double height_m = seen.front().lamp_m.z() - 2;
  const double height_sd_m = std::sqrt(fix.fix.covariance(2, 2));
  for (const auto& [factor, status] :
       {std::pair(0.98, FixStatus::ok), {1.02, FixStatus::degenerate}}) {
    auto noisy = seen;
    for (Sighting& sighting : noisy) sighting.sigma_px *= factor * height_m / height_sd_m;
    EXPECT_EQ(estimate_and_check_pose(noisy, 1).status, status) << factor;
  }
}

/// The first full step from far below leads above the lamps, and is halved.
TEST(EstimatePoseLeastSquares, ConvergesToTruthFromInitialPoseFarBelow) {
  const auto seen = sightings();
  const auto fix = estimate_pose_least_squares(seen, {{0, 0, -5}, 0.3});
  ASSERT_TRUE(fix);
  EXPECT_THAT(fix->pose.position_m, IsNear(kTruth.position_m, 1e-9));
  EXPECT_NEAR(fix->pose.yaw_rad, kTruth.yaw_rad, 1e-9);
}

}  // namespace
}  // namespace vlp
