// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Bodies that move, rotate and are tilted. Without noise the fix equals the truth for all
/// combinations of estimated states; with noise the scatter matches the reported covariance.
#include "positioning/pose_estimation.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "positioning/three_lamp_poses.h"
#include "support/body_rig.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr double kExactBody = 1e-9;
/// Standard deviation with negligible weight.
constexpr double kUnknown = 1e3;
constexpr double kTinyNoise_px = 1e-3;

struct Estimated {
  bool velocity, yaw_rate, lean;
};
constexpr std::array<Estimated, 8> kCombinations{{{false, false, false},
                                                  {true, false, false},
                                                  {false, true, false},
                                                  {true, true, false},
                                                  {false, false, true},
                                                  {true, false, true},
                                                  {false, true, true},
                                                  {true, true, true}}};

std::string name_of_combination(const testing::TestParamInfo<Estimated>& info) {
  const std::string name = std::string(info.param.velocity ? "Velocity" : "") +
                           (info.param.yaw_rate ? "YawRate" : "") + (info.param.lean ? "Lean" : "");
  return name.empty() ? "Given" : name;
}

BodyState random_state(Random& random, double max_tilt_rad) {
  BodyState state;
  for (int i = 0; i < 3; ++i) state.pose.position_m[i] = random.uniform(-0.3, 0.3);
  state.pose.yaw_rad = random.uniform(-3.1, 3.1);
  state.motion.velocity_m_per_s.x() = random.uniform(-2, 2);
  state.motion.velocity_m_per_s.y() = random.uniform(-2, 2);
  state.motion.yaw_rate_rad_per_s = random.uniform(-1.6, 1.6);
  state.motion.inclination.roll_rad = random.uniform(-max_tilt_rad, max_tilt_rad);
  state.motion.inclination.pitch_rad = random.uniform(-max_tilt_rad, max_tilt_rad);
  return state;
}

/// States that are not estimated are exact; estimated states are unknown.
Sensors sensors_for(const BodyState& state, const Estimated& estimated) {
  Sensors sensors;
  KnownMotion motion;
  if (estimated.velocity) {
    motion.velocity_sd_m_per_s = kUnknown;
  } else {
    motion.velocity_m_per_s = state.motion.velocity_m_per_s;
  }
  if (estimated.yaw_rate) {
    motion.yaw_rate_sd_rad_per_s = kUnknown;
  } else {
    motion.yaw_rate_rad_per_s = state.motion.yaw_rate_rad_per_s;
  }
  if (estimated.lean) {
    sensors.inclination_sigma_rad = kUnknown;
  } else {
    sensors.inclination = state.motion.inclination;
  }
  sensors.motion = motion;
  return sensors;
}

void expect_state(const Fix& fix, const BodyState& state, double tolerance) {
  ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
  EXPECT_THAT(fix.state.pose.position_m, IsNear(state.pose.position_m, tolerance));
  EXPECT_NEAR(wrap_angle_rad(fix.state.pose.yaw_rad - state.pose.yaw_rad), 0, tolerance);
  // A hundredth of a second lies between the first row and the last.
  EXPECT_THAT(fix.state.motion.velocity_m_per_s,
              IsNear(state.motion.velocity_m_per_s, 100 * tolerance));
  EXPECT_NEAR(fix.state.motion.yaw_rate_rad_per_s, state.motion.yaw_rate_rad_per_s,
              100 * tolerance);
  const Inclination& lean = state.motion.inclination;
  EXPECT_NEAR(wrap_angle_rad(fix.state.motion.inclination.roll_rad - lean.roll_rad), 0, tolerance);
  EXPECT_NEAR(wrap_angle_rad(fix.state.motion.inclination.pitch_rad - lean.pitch_rad), 0,
              tolerance);
}

class PositionerNoiselessMovingCamera : public testing::TestWithParam<Estimated> {
 protected:
  Random random{41};

  void expect_exact(BodyRig rig, std::size_t lamps, bool one_height, double min_rad) {
    rig.map = draw_lamps_in_view(rig, lamps, one_height, min_rad, random);
    const auto detections = seen_from(rig, kTinyNoise_px);
    if (detections.size() < lamps) return;
    const Fix fix =
        rig.positioner().compute_position_fix(detections, sensors_for(rig.body, GetParam()));
    expect_state(fix, rig.body, kExactBody);
    ++fixes;
  }
  int fixes = 0;
};

TEST_P(PositionerNoiselessMovingCamera, MatchesTruthForLampsAtOneHeight) {
  for (int i = 0; i < 60; ++i) {
    expect_exact({{}, rolling_calibration(), random_state(random, 0.1), {}}, 7, true, 0.4);
  }
  EXPECT_GT(fixes, 40);
}

TEST_P(PositionerNoiselessMovingCamera, MatchesTruthForLampsAtManyHeights) {
  for (int i = 0; i < 60; ++i) {
    expect_exact({{}, rolling_calibration(), random_state(random, 0.1), {}}, 7, false, 0.4);
  }
  EXPECT_GT(fixes, 40);
}

TEST_P(PositionerNoiselessMovingCamera, PoseAndMotionMatchTruthWithColumnReadoutAndCalibratedTilt) {
  for (int i = 0; i < 40; ++i) {
    BodyRig rig{{}, rolling_calibration(), random_state(random, 0.1), {}};
    rig.calibration.camera.readout = Readout::columns;
    rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.05, 0.1 * i);
    expect_exact(rig, 7, i % 2 == 0, 0.4);
  }
  EXPECT_GT(fixes, 25);
}

TEST_P(PositionerNoiselessMovingCamera, MatchesRobotPoseWithCameraMount) {
  for (int i = 0; i < 40; ++i) {
    BodyRig rig{{}, rolling_calibration(), random_state(random, 0.1), {}};
    rig.mount = CameraMount{{0.3, -0.1, 0.2}, 0.1 * i};
    expect_exact(rig, 7, i % 2 == 0, 0.4);
  }
  EXPECT_GT(fixes, 25);
}

TEST_P(PositionerNoiselessMovingCamera, MatchesTruthForTiltUpTo80Degrees) {
  for (int i = 0; i < 80; ++i) {
    BodyRig rig{{}, rolling_calibration(), random_state(random, 0), {}};
    rig.body.motion.inclination.roll_rad = rad_from_deg(random.uniform(-80, 80));
    if (i % 2)
      std::swap(rig.body.motion.inclination.roll_rad, rig.body.motion.inclination.pitch_rad);
    expect_exact(rig, 7, i % 4 < 2, 0.25);
  }
  EXPECT_GT(fixes, 40);
}

/// A correct prior does not change the fix, even if the lamps hardly determine the state.
TEST_P(PositionerNoiselessMovingCamera, MatchesTruthForFewLampsWithTruePriorMean) {
  for (int i = 0; i < 60; ++i) {
    BodyRig rig{{}, rolling_calibration(), random_state(random, 0.1), {}};
    const std::size_t lamps = 2 + random.index(3);
    rig.map = draw_lamps_in_view(rig, lamps, true, 0.4, random);
    const auto detections = seen_from(rig, 0.1);
    if (detections.size() < lamps) continue;
    Sensors sensors;
    const BodyMotion& motion = rig.body.motion;
    sensors.motion = {motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
                      GetParam().velocity ? 0.5 : 0, GetParam().yaw_rate ? 0.3 : 0};
    sensors.inclination = motion.inclination;
    sensors.inclination_sigma_rad = GetParam().lean ? 0.02 : 0;
    expect_state(rig.positioner().compute_position_fix(detections, sensors), rig.body, kExactBody);
    ++fixes;
  }
  EXPECT_GT(fixes, 40);
}

INSTANTIATE_TEST_SUITE_P(Estimates, PositionerNoiselessMovingCamera,
                         testing::ValuesIn(kCombinations), name_of_combination);

TEST(LinearizeObservation, JacobianMatchesFiniteDifferencesOfResiduals) {
  // Central differences: step^2 and rounding / step.
  constexpr double step = 1e-6, tolerance = 1e-7;
  const Eigen::Vector3d arm_m(0.2, -0.1, 0.3);
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const BodyState state = random_state(random, 1.4);
    LampObservation seen{{1.1, 0.4, 2.5}, {}, {}, 1, random.uniform(-0.2, 0.2)};
    const Eigen::Vector3d q =
        EvaluatedState(state).lamp_position_in_body(seen.lamp_m, seen.time_s) - arm_m;
    seen.ray = (q + Eigen::Vector3d(0.02, -0.01, 0.03)).normalized();
    seen.depth_axis = (seen.ray + Eigen::Vector3d(0.1, 0.2, -0.1)).normalized();
    seen.whitened_pixel_from_ray.row(0) = seen.ray.unitOrthogonal();
    seen.whitened_pixel_from_ray.row(1) = 2 * seen.ray.cross(seen.ray.unitOrthogonal());
    const auto linearized = linearize_observation(seen, EvaluatedState(state), arm_m);
    for (int index = 0; index < kBodyStates; ++index) {
      const auto residual = [&](double change) {
        BodyState at = state;
        BodyMotion& motion = at.motion;
        if (index < 3) at.pose.position_m[index] += change;
        if (index == kBodyYaw) at.pose.yaw_rad += change;
        if (index == kBodyVelocity) motion.velocity_m_per_s.x() += change;
        if (index == kBodyVelocity + 1) motion.velocity_m_per_s.y() += change;
        if (index == kBodyYawRate) motion.yaw_rate_rad_per_s += change;
        if (index == kBodyRoll) motion.inclination.roll_rad += change;
        if (index == kBodyPitch) motion.inclination.pitch_rad += change;
        return linearize_observation(seen, EvaluatedState(at), arm_m).residual;
      };
      const Eigen::Vector2d difference = (residual(-step) - residual(step)) / (2 * step);
      EXPECT_THAT(Eigen::Vector2d(linearized.jacobian.col(index)), IsNear(difference, tolerance))
          << index;
    }
  }
}

TEST(ComputeWhitenedPixelJacobianWrtRay, MapsRayDisplacementToPixelDisplacement) {
  const Camera camera = synthetic_camera();
  const Lens lens(camera.lens_model, camera.intrinsics);
  constexpr double step_px = 1e-3, sigma_px = 0.25;
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(100, 500), Eigen::Vector2d(420, 290)}) {
    const auto ray = lens.unproject_pixel(pixel);
    ASSERT_TRUE(ray);
    const auto matrix =
        compute_whitened_pixel_jacobian_wrt_ray(ray->direction, ray->d_direction_d_pixel, sigma_px);
    ASSERT_TRUE(matrix);
    const Eigen::Vector3d unit_ray = ray->direction.normalized();
    EXPECT_THAT(Eigen::Vector2d(*matrix * unit_ray), IsNear(Eigen::Vector2d(0, 0), 1e-9));
    for (const Eigen::Vector2d& move : {Eigen::Vector2d(step_px, 0), Eigen::Vector2d(0, step_px)}) {
      const Eigen::Vector3d moved = lens.unproject_pixel(pixel + move).value().direction;
      const Eigen::Vector2d found = *matrix * moved / unit_ray.dot(moved) * sigma_px;
      EXPECT_THAT(found, IsNear(move, 1e-7));
    }
  }
}

TEST(ComputeBodyStateChiSquared, SumsPixelAndPriorTermsUnlessLampIsBehind) {
  constexpr double focal_px = 500, sigma_px = 0.5;
  Eigen::Matrix<double, 3, 2> d_ray_d_pixel = Eigen::Matrix<double, 3, 2>::Zero();
  d_ray_d_pixel.topRows<2>().diagonal().setConstant(1 / focal_px);
  const Eigen::Vector3d axis(0, 0, 1);
  const auto whitened = compute_whitened_pixel_jacobian_wrt_ray(axis, d_ray_d_pixel, sigma_px);
  ASSERT_TRUE(whitened);
  // The lamp is 2 m above the camera, and 25 px and 50 px away from the optical axis.
  std::vector<LampObservation> seen{{{0.1, 0.2, 2.5}, axis, *whitened, sigma_px, 0}};
  const Eigen::Vector3d arm_m(0, 0, 0.5);
  BodyPrior prior;
  EXPECT_NEAR(compute_body_state_chi_squared(seen, {arm_m, prior}, {}).value_or(0),
              50 * 50 + 100 * 100, 1e-6);
  prior.mean.pose.position_m.z() = 0.1;
  prior.set_sd(kBodyZ, 0.05);
  prior.mean.motion.velocity_m_per_s = {0.3, 0};
  prior.set_sd(kBodyVelocity, 0.1);
  prior.mean.motion.yaw_rate_rad_per_s = 0.8;
  prior.set_sd(kBodyYawRate, 0.2);
  prior.mean.motion.inclination = {0, -0.5};
  prior.set_sd(kBodyRoll, 0.1);
  EXPECT_NEAR(compute_body_state_chi_squared(seen, {arm_m, prior}, {}).value_or(0),
              50 * 50 + 100 * 100 + 2 * 2 + 3 * 3 + 4 * 4 + 5 * 5, 1e-6);
  seen.push_back({{0.1, 0.2, -1}, axis, *whitened, sigma_px, 0});
  EXPECT_FALSE(compute_body_state_chi_squared(seen, {arm_m, prior}, {}))
      << "the second lamp is behind";
}

TEST(ComputePosesFromThreeLamps, ContainsTruePoseForRandomScenes) {
  Random random(6);
  int exact = 0;
  constexpr int draws = 5000;
  for (int i = 0; i < draws; ++i) {
    std::array<Eigen::Vector3d, 3> lamps_m, rays;
    const BodyState state = random_state(random, 1.2);
    const Eigen::Isometry3d camera_from_world = world_from_body(state, 0).inverse();
    for (std::size_t k = 0; k < 3; ++k) {
      lamps_m[k].x() = random.uniform(-2, 2);
      lamps_m[k].y() = random.uniform(-2, 2);
      lamps_m[k].z() = i % 2 ? 2 : random.uniform(1.7, 2.3);
      rays[k] = (camera_from_world * lamps_m[k]).normalized();
    }
    const ThreeLampPoses found = compute_poses_from_three_lamps(lamps_m, rays);
    double nearest = 1;
    for (int k = 0; k < found.count; ++k) {
      const FreePose& pose = found.poses[static_cast<std::size_t>(k)];
      nearest = std::min(nearest, (pose.position_m - state.pose.position_m).norm() +
                                      (pose.camera_from_world - camera_from_world.linear()).norm());
    }
    exact += nearest < 1e-7;
  }
  // A few draws have two nearly equal solutions.
  EXPECT_GE(exact, draws - 5);
}

/// Largest error of rays of an exact pose; others are between two solutions that have vanished.
constexpr double kMaxExactError = 1e-6;

/// Returns the largest sine of the angle between a lamp's direction from the pose and its ray.
double compute_max_ray_error(const FreePose& pose, const std::array<Eigen::Vector3d, 3>& lamps_m,
                             const std::array<Eigen::Vector3d, 3>& rays) {
  double max_error = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d lamp_in_camera_m =
        pose.camera_from_world * (lamps_m[i] - pose.position_m);
    max_error = std::max(max_error, lamp_in_camera_m.normalized().cross(rays[i]).norm());
  }
  return max_error;
}

/// Newton's method refines the distances to rounding.
TEST(ComputePosesFromThreeLamps, PosesMatchRaysToRounding) {
  Random random(7);
  int num_poses = 0, num_exact = 0, num_between = 0;
  for (int i = 0; i < 1000; ++i) {
    std::array<Eigen::Vector3d, 3> lamps_m, rays;
    for (std::size_t k = 0; k < 3; ++k) {
      lamps_m[k] = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(1.7, 2.3)};
      rays[k] = lamps_m[k].normalized();
    }
    const ThreeLampPoses found = compute_poses_from_three_lamps(lamps_m, rays);
    for (std::size_t k = 0; k < static_cast<std::size_t>(found.count); ++k) {
      const double error = compute_max_ray_error(found.poses[k], lamps_m, rays);
      ++(error < kMaxExactError ? num_poses : num_between);
      num_exact += error < 1e-13;
    }
  }
  EXPECT_GT(num_poses, 1000);
  EXPECT_LT(num_between, num_poses / 10);
  // Nearly equal solutions amplify rounding errors.
  EXPECT_GE(num_exact, num_poses - num_poses / 100);
}

/// Rays of other points than the lamps: some have no pose, and nearly all poses match the rays.
TEST(ComputePosesFromThreeLamps, ReturnsPosesOfRandomRaysOnlyIfTheyMatch) {
  Random random(8);
  int num_without_pose = 0, num_poses = 0, num_matches = 0, num_between = 0;
  for (int i = 0; i < 1000; ++i) {
    std::array<Eigen::Vector3d, 3> lamps_m, rays;
    for (std::size_t k = 0; k < 3; ++k) {
      lamps_m[k] = {random.uniform(-2, 2), random.uniform(-2, 2), 2};
      const double x = random.uniform(-2, 2), y = random.uniform(-2, 2);
      rays[k] = Eigen::Vector3d(x, y, 1).normalized();
    }
    const ThreeLampPoses found = compute_poses_from_three_lamps(lamps_m, rays);
    num_without_pose += found.count == 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(found.count); ++k) {
      const FreePose& pose = found.poses[k];
      EXPECT_THAT(Eigen::Matrix3d(pose.camera_from_world * pose.camera_from_world.transpose()),
                  IsNear(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), 1e-9));
      const double error = compute_max_ray_error(pose, lamps_m, rays);
      ++(error < kMaxExactError ? num_poses : num_between);
      num_matches += error < 1e-9;
    }
  }
  EXPECT_GT(num_without_pose, 10);
  EXPECT_GT(num_poses, 400);
  EXPECT_LT(num_between, num_poses / 4);
  EXPECT_GE(num_matches, num_poses - num_poses / 50);
}

TEST(ComputePosesFromThreeLamps, ReturnsNoPoseForCollinearLamps) {
  const std::array<Eigen::Vector3d, 3> lamps_m{
      Eigen::Vector3d(-1, 0.2, 2), {0, 0.2, 2}, {1, 0.2, 2}};
  std::array<Eigen::Vector3d, 3> rays;
  for (std::size_t i = 0; i < 3; ++i) rays[i] = lamps_m[i].normalized();
  EXPECT_EQ(compute_poses_from_three_lamps(lamps_m, rays).count, 0);
}

/// Noise may remove two nearly equal solutions; which of them are kept does not depend on the unit
/// of length.
TEST(ComputePosesFromThreeLamps, ReturnsScaledPosesForScaledLamps) {
  Random random(9);
  int poses = 0, equal = 0;
  for (int i = 0; i < 2000; ++i) {
    std::array<Eigen::Vector3d, 3> lamps_m, lamps_cm, rays;
    for (std::size_t k = 0; k < 3; ++k) {
      lamps_m[k] = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(1.7, 2.3)};
      lamps_cm[k] = 100 * lamps_m[k];
      rays[k] = lamps_m[k] + 0.05 * Eigen::Vector3d(random.normal(), random.normal(), 0);
      rays[k].normalize();
    }
    const ThreeLampPoses found = compute_poses_from_three_lamps(lamps_m, rays);
    const ThreeLampPoses scaled = compute_poses_from_three_lamps(lamps_cm, rays);
    ASSERT_EQ(scaled.count, found.count) << i;
    poses += found.count;
    for (std::size_t k = 0; k < static_cast<std::size_t>(found.count); ++k) {
      const FreePose &pose = found.poses[k], &scaled_pose = scaled.poses[k];
      equal += (scaled_pose.position_m - 100 * pose.position_m).norm() < 1e-4 &&
               (scaled_pose.camera_from_world - pose.camera_from_world).norm() < 1e-6;
    }
  }
  EXPECT_GT(poses, 2000);
  // Nearly equal solutions amplify rounding errors.
  EXPECT_GE(equal, poses - poses / 100);
}

/// A lamp with equal distances and angles to both others: one of the conics is a pair of lines.
TEST(ComputePosesFromThreeLamps, ContainsTruePositionForSymmetricLamps) {
  for (const double up_m : {-2.0, -1.5}) {
    for (const double aside_m : {0.0, 0.3}) {
      const Eigen::Vector3d camera_m(0, aside_m, up_m);
      const std::array<Eigen::Vector3d, 3> lamps_m{
          Eigen::Vector3d(-0.5, -0.5, 0), {0.5, -0.5, 0}, {0, 0.6, 0}};
      std::array<Eigen::Vector3d, 3> rays;
      for (std::size_t i = 0; i < 3; ++i) rays[i] = (lamps_m[i] - camera_m).normalized();
      const ThreeLampPoses found = compute_poses_from_three_lamps(lamps_m, rays);
      double nearest_m = 1;
      for (int i = 0; i < found.count; ++i) {
        const FreePose& pose = found.poses[static_cast<std::size_t>(i)];
        nearest_m = std::min(nearest_m, (pose.position_m - camera_m).norm());
      }
      EXPECT_LT(nearest_m, 1e-6) << camera_m.transpose();
    }
  }
}

/// Compares the scatter of the states over many draws with the reported covariance.
class BodyScatter {
 public:
  using Vector = Eigen::Matrix<double, kBodyStates, 1>;

  static Vector to_vector(const Fix& fix) {
    const auto& [pose, motion] = fix.state;
    Vector all;
    all << pose.position_m, pose.yaw_rad, motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
        motion.inclination.roll_rad, motion.inclination.pitch_rad;
    return all;
  }

  void add(const Vector& error) {
    sum_ += error;
    squares_ += error * error.transpose();
    ++count_;
  }
  /// Checks the ratio of found to reported standard deviation of each estimated state.
  void expect(const BodyCovariance& stated, double tolerance) const {
    const Vector mean = sum_ / count_;
    const BodyCovariance found = squares_ / count_ - mean * mean.transpose();
    for (int i = 0; i < kBodyStates; ++i) {
      if (stated(i, i) == 0) {
        EXPECT_EQ(found(i, i), 0) << i;
        continue;
      }
      EXPECT_NEAR(std::sqrt(found(i, i) / stated(i, i)), 1, tolerance) << i;
      EXPECT_LT(std::abs(mean[i]), 5 * std::sqrt(stated(i, i) / count_)) << i;
      for (int k = 0; k < i; ++k) {
        if (stated(k, k) == 0) continue;
        const double scale = std::sqrt(stated(i, i) * stated(k, k));
        EXPECT_NEAR(found(i, k) / scale, stated(i, k) / scale, 2 * tolerance) << i << " " << k;
      }
    }
  }

 private:
  Vector sum_ = Vector::Zero();
  BodyCovariance squares_ = BodyCovariance::Zero();
  double count_ = 0;
};

/// 4,000 draws determine a standard deviation to 1.1 %.
constexpr int kBodyDraws = 4000;
constexpr double kBodyScatterTolerance = 0.05;

class MovingCameraFixCovariance : public testing::TestWithParam<Estimated> {
 protected:
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};

  void SetUp() override {
    rig.body = {{{0.1, -0.05, 0.05}, 0.7}, {{0.8, -0.5}, 0.6, {0.03, -0.05}}};
  }
};

TEST_P(MovingCameraFixCovariance, MatchesScatterOfFixesWithLampsAlone) {
  const auto exact = seen_from(rig, 0.05);
  ASSERT_EQ(exact.size(), 8);
  const Positioner positioner = rig.positioner();
  const Sensors sensors = sensors_for(rig.body, GetParam());
  const Fix stated = positioner.compute_position_fix(exact, sensors);
  ASSERT_TRUE(stated.has_succeeded()) << fix_status_name(stated.status);
  const auto truth = BodyScatter::to_vector(stated);
  BodyScatter scatter;
  Random random(51);
  for (int i = 0; i < kBodyDraws; ++i) {
    const Fix fix = positioner.compute_position_fix(with_noise(exact, random), sensors);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    scatter.add(BodyScatter::to_vector(fix) - truth);
  }
  scatter.expect(stated.covariance, kBodyScatterTolerance);
}

/// Odometry and inclination sensor with errors of the reported size.
TEST_P(MovingCameraFixCovariance, MatchesScatterOfFixesWithLampsAndSensors) {
  rig.mount = CameraMount{{0.2, -0.1, 0.3}, 0.5};
  auto exact = seen_from(rig, 0.05);
  ASSERT_GE(exact.size(), 4);
  exact.resize(4);
  const Positioner positioner = rig.positioner();
  const BodyMotion& motion = rig.body.motion;
  Sensors sensors;
  sensors.motion = {motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
                    GetParam().velocity ? 0.05 : 0, GetParam().yaw_rate ? 0.02 : 0};
  sensors.inclination = motion.inclination;
  sensors.inclination_sigma_rad = GetParam().lean ? 0.003 : 0;
  const Fix stated = positioner.compute_position_fix(exact, sensors);
  ASSERT_TRUE(stated.has_succeeded()) << fix_status_name(stated.status);
  const auto truth = BodyScatter::to_vector(stated);
  BodyScatter scatter;
  Random random(52);
  for (int i = 0; i < kBodyDraws; ++i) {
    Sensors read = sensors;
    for (int k = 0; k < 2; ++k) {
      read.motion->velocity_m_per_s[k] += sensors.motion->velocity_sd_m_per_s * random.normal();
    }
    read.motion->yaw_rate_rad_per_s += sensors.motion->yaw_rate_sd_rad_per_s * random.normal();
    read.inclination->roll_rad += sensors.inclination_sigma_rad * random.normal();
    read.inclination->pitch_rad += sensors.inclination_sigma_rad * random.normal();
    const Fix fix = positioner.compute_position_fix(with_noise(exact, random), read);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    scatter.add(BodyScatter::to_vector(fix) - truth);
  }
  scatter.expect(stated.covariance, kBodyScatterTolerance);
}

INSTANTIATE_TEST_SUITE_P(Estimates, MovingCameraFixCovariance, testing::ValuesIn(kCombinations),
                         name_of_combination);

TEST(Positioner, RedundancyMatchesMeanSquaredPixelResidualForMovingCamera) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  rig.body = {{{0.1, -0.05, 0.05}, 0.7}, {{0.8, -0.5}, 0.6, {0.03, -0.05}}};
  const auto exact = seen_from(rig, 0.05);
  Sensors sensors;
  sensors.motion = KnownMotion::make_motion_prior_from_limits(2, 2);
  sensors.inclination_sigma_rad = 1;
  const Positioner positioner = rig.positioner();
  Random random(53);
  double sum = 0, redundancy = 0;
  for (int i = 0; i < kBodyDraws; ++i) {
    const Fix fix = positioner.compute_position_fix(with_noise(exact, random), sensors);
    ASSERT_TRUE(fix.has_succeeded());
    sum += 8 * std::pow(fix.residual_px / 0.05, 2);
    redundancy += fix.redundancy;
  }
  EXPECT_NEAR(redundancy / kBodyDraws, 7, 0.1);  // 16 pixels, 9 states
  EXPECT_NEAR(sum / redundancy, 1, 0.04);
}

}  // namespace
}  // namespace vlp
