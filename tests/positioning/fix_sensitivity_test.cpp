// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the covariance and the redundancy of exact fixes with finite differences by each pixel
/// coordinate and by each reading of a sensor: the sum over all of variance times derivative
/// squared.
#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "support/body_rig.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// The motion is slow: the effect of a pixel's error on its readout time, which the covariance
/// neglects, is below the tolerance.
class FixSensitivity : public testing::Test {
 protected:
  BodyRig rig{synthetic_lamps(),
              rolling_calibration(),
              {{{0.1, -0.05, 0.05}, 0.7}, {{0.02, -0.01}, 0.01, {0.03, -0.05}}},
              {}};
  Sensors sensors;
  PositionerOptions options;
  std::vector<Detection> detections;

  void SetUp() override {
    for (std::size_t i = 0; i < rig.map.lamps.size(); ++i) {
      rig.map.lamps[i].position_m.z() += 0.1 * static_cast<double>(i % 3);
    }
    rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.05, 1);
  }
  void stand_level() { rig.body.motion = {}; }
  /// Sets exact observations of the first lamps with different noise.
  void see_lamps(std::size_t count) {
    detections = seen_from(rig, 0.1);
    ASSERT_GE(detections.size(), count);
    detections.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      *detections[i].sigma_px += 0.05 * static_cast<double>(i % 4);
    }
    options.mount = rig.mount;
  }

  /// A quantity with an error: its standard deviation and how a fix with an error of it is made.
  struct Source {
    double sd;
    std::function<Fix(double)> locate;
  };
  /// Returns the reading `of(sensors)` as a source.
  Source reading(double sd, double& (*of)(Sensors&)) const {
    return {sd, [this, of](double error) {
              Sensors wrong = sensors;
              of(wrong) += error;
              return Positioner(rig.map, rig.calibration, options)
                  .compute_position_fix(detections, wrong);
            }};
  }
  std::vector<Source> sources() const {
    std::vector<Source> all;
    for (std::size_t i = 0; i < detections.size(); ++i) {
      for (const int axis : {0, 1}) {
        all.push_back({detections[i].sigma_px.value_or(options.unstated_sigma_px),
                       [this, i, axis](double error) {
                         auto wrong = detections;
                         wrong[i].pixel[axis] += error;
                         return Positioner(rig.map, rig.calibration, options)
                             .compute_position_fix(wrong, sensors);
                       }});
      }
    }
    if (sensors.height_and_yaw && detections.size() == 1) {
      const HeightAndYaw& known = *sensors.height_and_yaw;
      all.push_back(
          reading(known.z_sd_m, [](Sensors& s) -> double& { return s.height_and_yaw->z_m; }));
      all.push_back(reading(known.yaw_sd_rad,
                            [](Sensors& s) -> double& { return s.height_and_yaw->yaw_rad; }));
    }
    if (sensors.height) {
      all.push_back(
          reading(sensors.height->sd_m, [](Sensors& s) -> double& { return s.height->z_m; }));
    }
    if (sensors.motion) {
      const KnownMotion& motion = *sensors.motion;
      all.push_back(reading(motion.velocity_sd_m_per_s,
                            [](Sensors& s) -> double& { return s.motion->velocity_m_per_s.x(); }));
      all.push_back(reading(motion.velocity_sd_m_per_s,
                            [](Sensors& s) -> double& { return s.motion->velocity_m_per_s.y(); }));
      all.push_back(reading(motion.yaw_rate_sd_rad_per_s,
                            [](Sensors& s) -> double& { return s.motion->yaw_rate_rad_per_s; }));
    }
    if (sensors.inclination) {
      const double sd = sensors.inclination_sigma_rad;
      all.push_back(reading(sd, [](Sensors& s) -> double& { return s.inclination->roll_rad; }));
      all.push_back(reading(sd, [](Sensors& s) -> double& { return s.inclination->pitch_rad; }));
    }
    std::erase_if(all, [](const Source& source) { return source.sd == 0; });
    return all;
  }

  static Eigen::Vector4d pose_of(const Fix& fix) {
    EXPECT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    Eigen::Vector4d pose;
    pose << fix.state.pose.position_m, fix.state.pose.yaw_rad;
    return pose;
  }
  void expect_matches() const {
    const Fix fix =
        Positioner(rig.map, rig.calibration, options).compute_position_fix(detections, sensors);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.body.pose.position_m, 1e-5));
    EXPECT_EQ(fix.rejected_lamps, 0);
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
    double redundancy = 0;
    for (const Source& source : sources()) {
      const double step = 0.1 * source.sd;
      const Fix more = source.locate(step), less = source.locate(-step);
      const Eigen::Vector4d error = (pose_of(more) - pose_of(less)) / (2 * step) * source.sd;
      covariance += error * error.transpose();
      redundancy += (more.chi_squared + less.chi_squared) / 2 * std::pow(source.sd / step, 2);
    }
    const Eigen::Vector4d sd = covariance.diagonal().cwiseMax(1e-20).cwiseSqrt();
    EXPECT_LT((fix.noise_covariance.topLeftCorner<4, 4>() - covariance)
                  .cwiseQuotient(sd * sd.transpose())
                  .cwiseAbs()
                  .maxCoeff(),
              2e-3)
        << fix.noise_covariance << "\n\n"
        << covariance;
    EXPECT_EQ(fix.noise_covariance, fix.covariance) << "no other errors are reported";
    EXPECT_NEAR(fix.redundancy, redundancy, 0.01);
  }
};

TEST_F(FixSensitivity, FixCovarianceMatchesFiniteDifferencesForLevelCamera) {
  stand_level();
  for (const std::size_t lamps : {2u, 3u, 4u, 8u}) {
    SCOPED_TRACE(lamps);
    see_lamps(lamps);
    expect_matches();
  }
}

/// The fix weights equal noise in the undistorted image; the covariance is for the image.
TEST_F(FixSensitivity, FixCovarianceMatchesFiniteDifferencesWhenSigmaIsUnset) {
  stand_level();
  options.unstated_sigma_px = 0.3;
  for (const std::size_t lamps : {2u, 3u, 8u}) {
    SCOPED_TRACE(lamps);
    see_lamps(lamps);
    for (Detection& detection : detections) detection.sigma_px.reset();
    expect_matches();
  }
}

TEST_F(FixSensitivity, FixCovarianceMatchesFiniteDifferencesForExactlyKnownInclination) {
  stand_level();
  rig.body.motion.inclination = {0.08, -0.05};
  rig.mount = CameraMount{{0.3, -0.2, 0.4}, 0.5};
  sensors.inclination = rig.body.motion.inclination;
  see_lamps(4);
  expect_matches();
}

TEST_F(FixSensitivity, FixCovarianceMatchesFiniteDifferencesForOneLamp) {
  for (const bool on_robot : {false, true}) {
    SCOPED_TRACE(on_robot);
    if (on_robot) rig.mount = CameraMount{{0.3, -0.2, 0.4}, 0.5};
    const BodyMotion& motion = rig.body.motion;
    sensors.motion = KnownMotion{motion.velocity_m_per_s, motion.yaw_rate_rad_per_s, 0.2, 0.3};
    sensors.inclination = motion.inclination;
    sensors.inclination_sigma_rad = 0.004;
    const Eigen::Isometry3d camera = world_from_body(rig.body, 0) * body_from_camera(rig);
    sensors.height_and_yaw = HeightAndYaw{
        camera.translation().z(),
        rig.body.pose.yaw_rad + (on_robot ? rig.mount->yaw_in_robot_rad : 0), 0.01, 0.02};
    see_lamps(1);
    expect_matches();
  }
}

/// Priors of the states, some of them exact.
class FixSensitivityWithPriors : public FixSensitivity, public testing::WithParamInterface<int> {};

TEST_P(FixSensitivityWithPriors, FixCovarianceMatchesFiniteDifferencesForUncertainMotionAndTilt) {
  const BodyMotion& motion = rig.body.motion;
  rig.mount = CameraMount{{0.3, -0.2, 0.4}, 0.5};
  const int free = GetParam();
  const bool velocity = free % 2 == 1, yaw_rate = free / 2 % 2 == 1, lean = free / 4 == 1;
  sensors.motion = KnownMotion{motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
                               velocity ? 0.05 : 0, yaw_rate ? 0.04 : 0};
  sensors.inclination = motion.inclination;
  sensors.inclination_sigma_rad = lean ? 0.003 : 0;
  for (const bool with_height : {false, true}) {
    SCOPED_TRACE(with_height);
    if (with_height) sensors.height = KnownHeight{rig.body.pose.position_m.z(), 0.002};
    see_lamps(5);
    expect_matches();
    const Fix fix =
        Positioner(rig.map, rig.calibration, options).compute_position_fix(detections, sensors);
    const BodyCovariance& covariance = fix.covariance;
    EXPECT_EQ(covariance(kBodyYawRate, kBodyYawRate) > 0, yaw_rate);
    EXPECT_EQ(covariance(kBodyRoll, kBodyRoll) > 0, lean);
  }
}

INSTANTIATE_TEST_SUITE_P(FreeStates, FixSensitivityWithPriors, testing::Range(0, 8));

}  // namespace
}  // namespace vlp
