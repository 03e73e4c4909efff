// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Without noise a fix equals the truth to rounding. Pixels are computed from world to image.
#include <gtest/gtest.h>

#include "camera/lens.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

constexpr double kExact_m = 1e-9;
constexpr double kExact_rad = 1e-9;

LampMap first_lamps(std::size_t count, bool equal_heights) {
  LampMap map = synthetic_lamps();
  map.lamps.resize(count);
  constexpr double offsets_m[] = {0, 0.35, -0.2, 0.5, 0.1, -0.3, 0.25, 0.05};
  for (std::size_t i = 0; i < count && !equal_heights; ++i) {
    map.lamps[i].position_m.z() += offsets_m[i];
  }
  return map;
}

SyntheticRig make_rig(std::size_t lamps, bool equal_heights) {
  return {first_lamps(lamps, equal_heights), {synthetic_camera(), {}, {}, {}, {}}, {}, {}};
}

void expect_exact(const SyntheticRig& rig, const Sensors& sensors = {}) {
  const auto detections = seen_from(rig);
  ASSERT_EQ(detections.size(), rig.map.lamps.size());
  const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(detections, sensors);
  ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
  EXPECT_EQ(fix.lamps, static_cast<int>(detections.size()));
  EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.camera.position_m, kExact_m));
  EXPECT_NEAR(wrap_angle_rad(fix.state.pose.yaw_rad - rig.camera.yaw_rad), 0, kExact_rad);
  EXPECT_NEAR(fix.residual_px, 0, 1e-6);  // 1e-9 m at f / H = 325 px/m
}

using LampsAndHeights = std::tuple<std::size_t, bool>;
class PositionerNoiseless : public testing::TestWithParam<LampsAndHeights> {
 protected:
  SyntheticRig rig = make_rig(std::get<0>(GetParam()), std::get<1>(GetParam()));
  Random random{7};

  Pose place() {
    return {{random.uniform(-0.25, 0.25), random.uniform(-0.2, 0.2), random.uniform(-0.1, 0.3)},
            random.uniform(-3.1, 3.1)};
  }
};

TEST_P(PositionerNoiseless, MatchesTruthAtEveryYaw) {
  for (int yaw_deg = -180; yaw_deg <= 180; yaw_deg += 5) {
    rig.camera = place();
    rig.camera.yaw_rad = rad_from_deg(yaw_deg);
    expect_exact(rig);
  }
}

TEST_P(PositionerNoiseless, MatchesTruthWithCalibratedTilt) {
  for (int tilt_deg = 0; tilt_deg <= 10; tilt_deg += 2) {
    rig.camera = place();
    rig.calibration.rotation_center =
        tilted_by(rig.calibration.camera, rad_from_deg(tilt_deg), random.uniform(-3.1, 3.1));
    expect_exact(rig);
  }
}

TEST_P(PositionerNoiseless, MatchesTruthWithCalibratedShiftAndDispersion) {
  rig.camera = place();
  rig.calibration.rotation_center = {RotationModel::shift, {411, 290}, {0, 0, 1}, {}};
  rig.calibration.dispersion = {{1.5, -2.5}, 0.01, {0, 0}, 40};
  expect_exact(rig);
}

TEST_P(PositionerNoiseless, MatchesTruthWithInclinationSensorAndCalibratedTilt) {
  for (int i = 0; i < 20; ++i) {
    rig.camera = place();
    rig.calibration.rotation_center = tilted_by(rig.calibration.camera, rad_from_deg(2), i);
    rig.inclination = {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)};
    expect_exact(rig, {rig.inclination, 0, {}});
  }
}

INSTANTIATE_TEST_SUITE_P(Lamps, PositionerNoiseless,
                         testing::Combine(testing::Values(2, 3, 4, 8), testing::Bool()),
                         [](const auto& instance) {
                           return std::to_string(std::get<0>(instance.param)) +
                                  (std::get<1>(instance.param) ? "AtOneHeight" : "AtManyHeights");
                         });

TEST(PositionerNoiseless, MatchesTruthForOneLampWithKnownHeightAndYaw) {
  SyntheticRig rig = make_rig(1, true);
  rig.camera = {{-0.3, 0.1, 0.2}, -2.5};
  expect_exact(rig, {{}, 0, HeightAndYaw{0.2, -2.5}});
}

TEST(PositionerNoiseless, MatchesRobotPoseWithCameraMount) {
  SyntheticRig rig = make_rig(4, true);
  const Pose robot{{0.1, -0.2, 0.05}, 3.0};
  const CameraMount mount{{0.12, -0.03, 0.2}, 0.4};
  rig.camera = {robot.position_m + rotation_about_z(robot.yaw_rad) * mount.position_in_robot_m,
                robot.yaw_rad + mount.yaw_in_robot_rad};
  PositionerOptions options;
  options.mount = mount;
  const Fix fix =
      Positioner(rig.map, rig.calibration, options).compute_position_fix(seen_from(rig));
  ASSERT_TRUE(fix.has_succeeded());
  EXPECT_THAT(fix.state.pose.position_m, IsNear(robot.position_m, kExact_m));
  EXPECT_NEAR(fix.state.pose.yaw_rad, robot.yaw_rad, kExact_rad);
}

TEST(PositionerNoiseless, MatchesPoseOfTiltedRobotWithCameraMount) {
  SyntheticRig rig = make_rig(4, true);
  const Eigen::Vector3d robot_m(0.1, -0.2, 0.05);
  const CameraMount mount{{0.12, -0.03, 0.2}, 1.3};
  const Inclination of_robot{0.08, -0.05};
  const double robot_yaw_rad = 0.6;
  rig.camera.yaw_rad = robot_yaw_rad + mount.yaw_in_robot_rad;
  rig.camera.position_m = robot_m + rotation_about_z(robot_yaw_rad) *
                                        level_rotation_from_inclination(of_robot) *
                                        mount.position_in_robot_m;
  // The same rotation about the axes of the camera, which are rotated relative to the robot's.
  const Eigen::Matrix3d camera_from_robot = rotation_about_z(-mount.yaw_in_robot_rad);
  const Eigen::Matrix3d lean =
      camera_from_robot * level_rotation_from_inclination(of_robot) * camera_from_robot.transpose();
  rig.inclination = {std::atan2(lean(2, 1), lean(2, 2)), -std::asin(lean(2, 0))};
  const double yaw_of_lean_rad = std::atan2(lean(1, 0), lean(0, 0));
  rig.camera.yaw_rad += yaw_of_lean_rad;  // Rz Ry Rx of the camera's axes
  PositionerOptions options;
  options.mount = mount;
  const Fix fix = Positioner(rig.map, rig.calibration, options)
                      .compute_position_fix(seen_from(rig), {of_robot, 0, {}});
  ASSERT_TRUE(fix.has_succeeded());
  EXPECT_THAT(fix.state.pose.position_m, IsNear(robot_m, kExact_m));
  EXPECT_NEAR(fix.state.pose.yaw_rad, robot_yaw_rad, kExact_rad);
}

/// Two of the lamps fit two poses; the third selects one.
TEST(PositionerNoiseless, MatchesTruthForThreeLampsWithAmbiguousPair) {
  Random random(4);
  int fixes = 0;
  for (int i = 0; i < 200; ++i) {
    SyntheticRig rig = make_rig(3, true);
    rig.map = make_lamp_map({{1.0, 0, 1.6}, {1.2, 0.1, 2.4}, {1.1, 0.06, 1.9}});
    rig.camera = {{random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), random.uniform(-0.3, 0.3)},
                  random.uniform(-3, 3)};
    const auto detections = seen_from(rig, 1e-3);
    if (detections.size() < 3) continue;
    const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(detections);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.camera.position_m, 1e-6));
    ++fixes;
  }
  EXPECT_GT(fixes, 0);
}

TEST(PositionerNoiseless, MatchesTruthForLargeNationalCoordinates) {
  SyntheticRig rig = make_rig(5, false);
  const Eigen::Vector3d origin_m(4.5e5, 5e6, 120);
  for (Lamp& lamp : rig.map.lamps) lamp.position_m += origin_m;
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    rig.camera = {origin_m + Eigen::Vector3d(0.1, -0.2, 0), random.uniform(-3, 3)};
    const Positioner positioner(rig.map, rig.calibration);
    const Fix exact = positioner.compute_position_fix(seen_from(rig));
    ASSERT_TRUE(exact.has_succeeded());
    // The coordinates themselves are rounded to 1e-9 m.
    EXPECT_THAT(exact.state.pose.position_m, IsNear(rig.camera.position_m, 1e-8));
    EXPECT_TRUE(
        positioner.compute_position_fix(with_noise(seen_from(rig, 0.5), random)).has_succeeded());
  }
}

TEST(PositionerNoiseless, MatchesTruthWithEveryLens) {
  const std::vector<double> opencv12{520,  522,  403,  296,  -0.28, 0.09,  1e-4, -2e-4,
                                     -.01, 0.02, 0.01, 1e-3, 1e-3,  -1e-3, 2e-3, 1e-3};
  std::vector<Camera> cameras{splined_camera(), fisheye_camera()};
  for (const LensModel model : {LensModel::pinhole, LensModel::stereographic, LensModel::opencv4,
                                LensModel::opencv5, LensModel::opencv8, LensModel::opencv12}) {
    cameras.push_back(synthetic_camera());
    cameras.back().lens_model = model;
    cameras.back().intrinsics = opencv12;
    cameras.back().intrinsics.resize(num_lens_parameters(model));
  }
  for (const Camera& camera : cameras) {
    SCOPED_TRACE(lens_model_name(camera.lens_model));
    SyntheticRig rig = make_rig(8, false);
    rig.calibration.camera = camera;
    rig.camera = {{0.1, 0.1, 0}, 1};
    expect_exact(rig);
  }
}

TEST(PositionerNoiseless, MatchesTruthForLampsBeyond90DegreesOffAxis) {
  SyntheticRig rig = make_rig(8, false);
  rig.calibration.camera = fisheye_camera();
  rig.camera = {{0.1, 0.1, 0}, 1};
  rig.inclination = {1.3, 0.2};
  const Lens lens(LensModel::fisheye, rig.calibration.camera.intrinsics);
  int beyond = 0;
  for (const Detection& detection : seen_from(rig)) {
    const auto ray = lens.unproject_pixel(detection.pixel);
    ASSERT_TRUE(ray);
    if (ray->direction.z() < 0) ++beyond;
  }
  EXPECT_GT(beyond, 0);
  expect_exact(rig, {rig.inclination, 0, {}});
}

}  // namespace
}  // namespace vlp
