// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>

#include "geometry/angles.h"
#include "positioning/closed_form.h"
#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

Sighting seen(const Eigen::Vector3d& lamp_m, const Pose& pose) {
  return {lamp_m, level_point_from_world(pose, lamp_m).hnormalized()};
}

Pose random_pose(Random& random) {
  return {{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-0.5, 0.5)},
          random.uniform(-3.1, 3.1)};
}

void expect_pose(const Pose& pose, const Pose& truth) {
  EXPECT_THAT(pose.position_m, IsNear(truth.position_m, 1e-9));
  EXPECT_NEAR(wrap_angle_rad(pose.yaw_rad - truth.yaw_rad), 0, 1e-9);
}

TEST(ComputeTwoLampPoses, ReturnsOnlyTruePoseForLampsAtEqualHeight) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Pose truth = random_pose(random);
    const TwoLampPoses fix =
        compute_two_lamp_poses(seen({-1, 0.5, 2.5}, truth), seen({1, 0.2, 2.5}, truth));
    ASSERT_EQ(fix.count, 1);
    expect_pose(fix.poses[0], truth);
  }
}

TEST(ComputeTwoLampPoses, ContainsTruePoseForLampsAtDifferentHeights) {
  Random random(4);
  int doubles = 0;
  for (int i = 0; i < 500; ++i) {
    const Pose truth = random_pose(random);
    const Sighting a = seen({random.uniform(-1, 1), random.uniform(-1, 1), 2.0}, truth);
    const Sighting b = seen({random.uniform(-1, 1), random.uniform(-1, 1), 2.6}, truth);
    const TwoLampPoses fix = compute_two_lamp_poses(a, b);
    ASSERT_GE(fix.count, 1);
    const bool first = (fix.poses[0].position_m - truth.position_m).norm() < 1e-6;
    if (fix.count == 2) ++doubles;
    // Near a double root the error is the square root of the rounding error.
    const Pose& nearest = fix.poses[first ? 0 : static_cast<std::size_t>(fix.count - 1)];
    EXPECT_LT((nearest.position_m - truth.position_m).norm(), 1e-6);
    for (int k = 0; k < fix.count; ++k) {
      const Pose& pose = fix.poses[static_cast<std::size_t>(k)];
      EXPECT_THAT(seen(a.lamp_m, pose).z, IsNear(a.z, 1e-9));
      EXPECT_THAT(seen(b.lamp_m, pose).z, IsNear(b.z, 1e-9));
    }
  }
  EXPECT_GT(doubles, 10) << "the ambiguous case was not met";
}

TEST(ComputeTwoLampPoses, ReturnsOnePoseWhereTwoPosesCoincide) {
  const Sighting a{{0, 0, 6}, {0.5, 0.5}};
  const Sighting b{{1, 0, 4}, {1, 0.5}};
  const TwoLampPoses fix = compute_two_lamp_poses(a, b);
  ASSERT_EQ(fix.count, 1);
  EXPECT_NEAR(fix.poses[0].position_m.z(), 2, 1e-12);
  EXPECT_THAT(seen(a.lamp_m, fix.poses[0]).z, IsNear(a.z, 1e-12));
  EXPECT_THAT(seen(b.lamp_m, fix.poses[0]).z, IsNear(b.z, 1e-12));
}

TEST(ComputeTwoLampPoses, ReturnsNoPoseForCoincidentImagePoints) {
  const Pose pose{{0, 0, 0}, 0};
  Sighting a = seen({0, 0, 2}, pose), b = seen({1, 0, 2}, pose);
  b.z = a.z;
  EXPECT_EQ(compute_two_lamp_poses(a, b).count, 0);
}

TEST(ComputeTwoLampPoses, FlagsLampBelowCameraAndReturnsNoPose) {
  // The only pose has the second lamp, 2 m below the first, at the camera's own height.
  const Sighting a{{0, 0, 3}, {-1, 0}};
  const Sighting b{{2, 0, 1}, {1, 0}};
  const TwoLampPoses fix = compute_two_lamp_poses(a, b);
  EXPECT_EQ(fix.count, 0);
  EXPECT_TRUE(fix.lamp_below_camera);
}

TEST(ComputePoseFromCoplanarLamps, MatchesTruthForThreeLampsOrMore) {
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const Pose truth = random_pose(random);
    std::vector<Sighting> sightings;
    for (int lamp = 0; lamp < 3 + i % 6; ++lamp) {
      sightings.push_back(seen({random.uniform(-1, 1), random.uniform(-1, 1), 2.2}, truth));
    }
    const auto pose = compute_pose_from_coplanar_lamps(sightings);
    ASSERT_TRUE(pose);
    expect_pose(*pose, truth);
  }
}

TEST(ComputeInitialPoses, AveragesNoiseOverThreeLampsAtEqualHeight) {
  const Pose truth{{0.1, -0.2, 0}, 0.4};
  std::array<Sighting, 3> sightings{seen({-1, 0.5, 2.5}, truth), seen({1, 0.2, 2.5}, truth),
                                    seen({0, -0.8, 2.5}, truth)};
  sightings[0].z.x() += 0.02;
  const InitialLevelPoses initial = compute_initial_poses(sightings);
  ASSERT_EQ(initial.status, FixStatus::ok);
  ASSERT_EQ(initial.count, 1);
  const auto pose = compute_pose_from_coplanar_lamps(sightings);
  ASSERT_TRUE(pose);
  expect_pose(initial.poses[0], *pose);
}

TEST(ComputePoseAtKnownHeightAndYaw, ReturnsTruePoseForOneLamp) {
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const Pose truth = random_pose(random);
    const auto pose = compute_pose_at_known_height_and_yaw(seen({0.3, -0.4, 2}, truth),
                                                           truth.position_m.z(), truth.yaw_rad);
    ASSERT_TRUE(pose);
    expect_pose(*pose, truth);
  }
}

TEST(ComputePoseAtKnownHeightAndYaw, ReturnsNulloptWhenLampIsNotAboveCamera) {
  const Sighting sighting = seen({0, 0, 2}, {{0, 0, 0}, 0});
  EXPECT_FALSE(compute_pose_at_known_height_and_yaw(sighting, 2, 0));
  EXPECT_FALSE(compute_pose_at_known_height_and_yaw(sighting, 2.5, 0));
}

}  // namespace
}  // namespace vlp
