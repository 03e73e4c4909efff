// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Planned captures of a scene.
#include "simulation/shot.h"

#include <gmock/gmock.h>

#include <set>

#include "geometry/angles.h"
#include "rig/board_layout.h"
#include "simulation/plain_scene.h"

namespace vlp {
namespace {

CaptureSet turning() {
  LampShots captures{{0, 0.3}, {{0.1, 0.2}, {0.3, 0.4}}, {}, {0, 2, 4}, 0.2, 0, 2, 0.5, false};
  return {"turning", 5e-5, captures, {}};
}

TEST(MakeLampShot, IteratesRepeatsFastestAndHeightsSlowest) {
  const Scene scene = plain_scene();
  const CaptureSet set = turning();
  ASSERT_EQ(count_shots(set), 2 * 2 * 3 * 2);
  const auto axis = [&](std::size_t index) {
    return make_lamp_shot(scene, set, index).motion.axis_m;
  };
  const auto yaw = [&](std::size_t index) {
    return make_lamp_shot(scene, set, index).motion.yaw_rad;
  };
  EXPECT_EQ(axis(0), Eigen::Vector3d(0.1, 0.2, 0));
  EXPECT_EQ(axis(5), Eigen::Vector3d(0.1, 0.2, 0));
  EXPECT_EQ(axis(6), Eigen::Vector3d(0.3, 0.4, 0));
  EXPECT_EQ(axis(23), Eigen::Vector3d(0.3, 0.4, 0.3));
  EXPECT_NEAR(yaw(0), 0, 0.2);
  EXPECT_NEAR(yaw(1), 0, 0.2);
  EXPECT_NEAR(yaw(2), 2, 0.2);
  EXPECT_NE(yaw(0), yaw(1));
  EXPECT_EQ(make_lamp_shot(scene, set, 7).time_s, 3.5);
  EXPECT_EQ(make_lamp_shot(scene, set, 7).image, "0007.png");
}

TEST(MakeLampShot, YawJitterDependsOnSeedFolderAndIndex) {
  Scene scene = plain_scene();
  CaptureSet set = turning();
  std::set<double> yaws{make_lamp_shot(scene, set, 3).motion.yaw_rad};
  EXPECT_TRUE(yaws.contains(make_lamp_shot(scene, set, 3).motion.yaw_rad));
  yaws.insert(make_lamp_shot(scene, set, 9).motion.yaw_rad);
  set.folder = "other";
  yaws.insert(make_lamp_shot(scene, set, 3).motion.yaw_rad);
  scene.seed = 2;
  yaws.insert(make_lamp_shot(scene, set, 3).motion.yaw_rad);
  EXPECT_EQ(yaws.size(), 4);
}

TEST(MakeLampShot, AdvancesGivenPhaseByTimeAndDrawsMissingOne) {
  Scene scene = plain_scene();
  scene.lamps[0].frequency_hz = 1000.5;
  scene.lamps[0].phase = 0.25;
  const CaptureSet set = turning();
  EXPECT_NEAR(make_lamp_shot(scene, set, 1).waves[0].phase, 0.5,
              1e-9);  // 500.25 + 0.25 periods on
  scene.lamps[0].phase.reset();
  std::set<double> phases;
  for (std::size_t i = 0; i < 24; ++i) phases.insert(make_lamp_shot(scene, set, i).waves[0].phase);
  EXPECT_EQ(phases.size(), 24);
  EXPECT_LT(*phases.begin(), 0.3);
  EXPECT_GT(*phases.rbegin(), 0.7);
}

TEST(MakeLampShot, MovesAlongDriveAtItsSpeed) {
  const Scene scene = plain_scene();
  CaptureSet set = turning();
  set.lamps->drive = StraightDrive{{0, 0}, {0.3, 0.4}, 0.1};
  const Pose before = make_lamp_shot(scene, set, 0).motion.camera_pose_at(-1);
  const Pose after = make_lamp_shot(scene, set, 0).motion.camera_pose_at(1);
  EXPECT_TRUE((after.position_m - before.position_m).isApprox(Eigen::Vector3d(0.12, 0.16, 0)));
}

TEST(MakeLampShot, ContinuesMotionOfPreviousCaptureOnDrive) {
  const Scene scene = plain_scene();
  const StraightDrive drive{{0, 0}, {0.3, 0.4}, 0.1};
  LampShots captures{{0, 0.3}, {}, drive, {0, 2}, 0, 0.4, 2, 0.5, false};
  for (int i = 0; i <= 10; ++i) captures.pivots_m.emplace_back(0.03 * i, 0.04 * i);
  const CaptureSet set{"drive", 5e-5, captures, {}};
  ASSERT_EQ(count_shots(set), 88);
  for (std::size_t i = 0; i + 1 < 88; ++i) {
    if (i % 11 == 10) continue;  // the next pass begins
    const LampShot before = make_lamp_shot(scene, set, i),
                   after = make_lamp_shot(scene, set, i + 1);
    const Pose expected = before.motion.camera_pose_at(after.time_s - before.time_s);
    EXPECT_TRUE(after.motion.camera_pose_at(0).position_m.isApprox(expected.position_m, 1e-12));
    EXPECT_NEAR(after.motion.yaw_rad, expected.yaw_rad, 1e-12);
  }
  EXPECT_EQ(make_lamp_shot(scene, set, 11).motion.axis_m, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(make_lamp_shot(scene, set, 22).motion.yaw_rad, 2);
  EXPECT_EQ(make_lamp_shot(scene, set, 44).motion.axis_m, Eigen::Vector3d(0, 0, 0.3));
}

TEST(BaseMotion, PoseRotatesLeverArmAboutAxis) {
  const Mount mount{Eigen::Matrix3d::Identity(), {0.1, 0}};
  const BaseMotion motion{{1, 2, 0.5}, {0, 0}, 0, rad_from_deg(90), mount};
  EXPECT_TRUE(motion.camera_pose_at(0).position_m.isApprox(Eigen::Vector3d(1.1, 2, 0.5)));
  EXPECT_TRUE(motion.camera_pose_at(1).position_m.isApprox(Eigen::Vector3d(1, 2.1, 0.5)));
  EXPECT_NEAR(motion.camera_pose_at(1).yaw_rad, rad_from_deg(90), 1e-15);
}

TEST(MakeBoardShot, DistanceTiltAndOffsetStayWithinAndReachLimits) {
  Scene scene = plain_scene();
  scene.board = plain_board();
  CaptureSet set = board_views(300, 0, rad_from_deg(40), rad_from_deg(30), 0.5);
  set.board->distance_m = {0.2, 0.5};
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  double farthest_m = 0, max_tilt = 0, max_offset = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    const Eigen::Isometry3d camera_from_board = make_board_shot(scene, set, i).camera_from_board(0);
    EXPECT_NEAR(camera_from_board.linear().determinant(), 1, 1e-12);
    Eigen::Vector3d middle_m(0, 0, 0);
    middle_m.head<2>() = compute_tag_field_size_m(scene.board->pattern) / 2;
    const Eigen::Vector3d middle = camera_from_board * middle_m;
    const double tilt =
        std::acos(std::min(1.0, middle.normalized().dot(camera_from_board.linear().col(2))));
    EXPECT_GE(middle.norm(), 0.2);
    EXPECT_LE(middle.norm(), 0.5);
    EXPECT_LE(tilt, rad_from_deg(40) + 1e-6);
    farthest_m = std::max(farthest_m, middle.norm());
    max_tilt = std::max(max_tilt, tilt);
    const Eigen::Vector2d pixel = lens.project_point(middle).value();
    max_offset =
        std::max({max_offset, std::abs(pixel.x() / 400 - 1), std::abs(pixel.y() / 300 - 1)});
  }
  EXPECT_GT(farthest_m, 0.49);
  EXPECT_GT(max_tilt, rad_from_deg(39));
  EXPECT_NEAR(max_offset, 0.5, 0.01);
}

// A circle of 353 px in an image of 800 x 600, whose corners have no ray.
TEST(MakeBoardShot, PlacesBoardAtLastRayWhereLensHasNone) {
  Scene scene = plain_scene();
  scene.camera = {
      "fisheye", {800, 600}, LensModel::fisheye, {290, 290, 399.5, 299.5, -0.1, 0, 0, 0},
      {},        3e-5,       Readout::rows};
  scene.board = plain_board();
  const CaptureSet set = board_views(300, 0.3, 0, 0, 1);
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  const double last_rad = std::sqrt(1 / 0.3);
  int at_the_rim = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    Eigen::Vector3d middle_m(0, 0, 0);
    middle_m.head<2>() = compute_tag_field_size_m(scene.board->pattern) / 2;
    const Eigen::Vector3d sight = make_board_shot(scene, set, i).camera_from_board(0) * middle_m;
    const double off_axis_rad = std::atan2(sight.head<2>().norm(), sight.z());
    EXPECT_LE(off_axis_rad, last_rad + 1e-6);
    if (off_axis_rad > last_rad - 1e-3) ++at_the_rim;
  }
  // Beyond the circle lie 21 % of the image.
  EXPECT_GT(at_the_rim, 0.15 * 300);
  EXPECT_LT(at_the_rim, 0.27 * 300);
}

TEST(BaseMotion, BaseInclinationIsGivenInclinationPlusVibration) {
  const Mount mount{Eigen::Matrix3d::Identity(), {0.1, 0}};
  BaseMotion motion{{1, 2, 0.5}, {0.5, 0}, 0.3, 0.2, mount};
  EXPECT_TRUE(motion.is_base_level());
  motion.inclination = {0.2, -0.1};
  EXPECT_FALSE(motion.is_base_level());
  const Eigen::Isometry3d pose = motion.world_from_camera(0);
  EXPECT_TRUE(pose.linear().isApprox(
      rotation_about_z(0.3) * level_rotation_from_inclination({0.2, -0.1}), 1e-14));
  EXPECT_TRUE(pose.translation().isApprox(motion.camera_pose_at(0).position_m));
  // Two thousandths of a radian at 25 Hz: a period is 0.04 s, roll and pitch a quarter of it apart.
  motion.vibration = {0.002, 25};
  EXPECT_FALSE(motion.is_base_at_rest());
  EXPECT_NEAR(motion.inclination_at(0).roll_rad, 0.2, 1e-15);
  EXPECT_NEAR(motion.inclination_at(0).pitch_rad, -0.1 + 0.002, 1e-15);
  EXPECT_NEAR(motion.inclination_at(0.01).roll_rad, 0.2 + 0.002, 1e-15);
  EXPECT_NEAR(motion.inclination_at(0.01).pitch_rad, -0.1, 1e-15);
}

TEST(BaseMotion, CameraVelocityEqualsDerivativeOfPosition) {
  const BaseMotion motion{
      {1, 2, 0.5}, {0.5, -1}, 0.3, 0.7, {Eigen::Matrix3d::Identity(), {0.1, 0.2}}};
  constexpr double step_s = 1e-6;
  const Eigen::Vector3d moved_m =
      motion.camera_pose_at(step_s).position_m - motion.camera_pose_at(-step_s).position_m;
  EXPECT_TRUE(motion.camera_velocity_m_per_s().isApprox(moved_m.head<2>() / (2 * step_s), 1e-8));
}

}  // namespace
}  // namespace vlp
