// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Bodies that move, rotate and are tilted. Without noise the fix equals the truth for all
/// combinations of estimated states; with noise the scatter matches the reported covariance.
#include "positioning/pose_estimation.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

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

/// Scene of a moving camera: lamps, and how the rig differs from that of a level robot.
struct MovingScene {
  const char* name;
  int draws, min_fixes;
  double min_distance_rad;
  void (*change)(BodyRig& rig, int draw, Random& random);
};

constexpr MovingScene kMovingScenes[] = {
    {"camera only", 120, 80, 0.4, [](BodyRig&, int, Random&) {}},
    {"columns and calibrated tilt", 40, 25, 0.4,
     [](BodyRig& rig, int draw, Random&) {
       rig.calibration.camera.readout = Readout::columns;
       rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.05, 0.1 * draw);
     }},
    {"camera on robot", 40, 25, 0.4,
     [](BodyRig& rig, int draw, Random&) {
       rig.mount = CameraMount{{0.3, -0.1, 0.2}, 0.1 * draw};
     }},
    {"tilt up to 80 degrees", 80, 40, 0.25, [](BodyRig& rig, int draw, Random& random) {
       const double tilt_rad = rad_from_deg(random.uniform(-80, 80));
       rig.body.motion.inclination =
           draw % 4 < 2 ? Inclination{tilt_rad, 0} : Inclination{0, tilt_rad};
     }}};

class PositionerNoiselessMovingCamera : public testing::TestWithParam<Estimated> {
 protected:
  Random random{41};
  int fixes = 0;
};

/// Lamps are at one height in every other scene.
TEST_P(PositionerNoiselessMovingCamera, StateMatchesTruthInEachScene) {
  for (const auto& [name, draws, min_fixes, min_distance_rad, change] : kMovingScenes) {
    SCOPED_TRACE(name);
    fixes = 0;
    for (int i = 0; i < draws; ++i) {
      BodyRig rig{{}, rolling_calibration(), random_state(random, 0.1), {}};
      change(rig, i, random);
      rig.map = draw_lamps_in_view(rig, 7, i % 2 == 0, min_distance_rad, random);
      const auto detections = seen_from(rig, kTinyNoise_px);
      if (detections.size() < 7) continue;
      expect_state(
          rig.positioner().compute_position_fix(detections, sensors_for(rig.body, GetParam())),
          rig.body, kExactBody);
      ++fixes;
    }
    EXPECT_GT(fixes, min_fixes);
  }
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
