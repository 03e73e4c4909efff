// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Fixes of a camera that looks down at lamps below it. Pixels are computed from world to image.
#include "positioning/lamps_below.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "positioning/vlp.h"
#include "rig/calibration_error.h"
#include "support/body_rig.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

constexpr double kSigma_px = 0.1;

/// A camera 1.4 m above lamps on a floor with steps.
class CameraAboveLamps : public testing::Test {
 protected:
  BodyRig rig;

  CameraAboveLamps() {
    std::vector<Eigen::Vector3d> positions_m;
    for (int i = 0; i < 12; ++i)
      positions_m.emplace_back(0.3 * (i % 4) - 0.3, 0.25 * (i / 4) - 0.3, 0.05 * (i % 3));
    rig.map = make_lamp_map(positions_m);
    rig.map.lamps_below_camera = true;
    rig.calibration = rolling_calibration();
    rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.02, 1);
    rig.body.pose = {{0.1, -0.05, 1.4}, 0.7};
  }
  void add_mount() { rig.mount = CameraMount{{0.1, -0.2, 0.3}, 0.4}; }

  Fix locate(const Sensors& sensors) const {
    const auto detections = seen_from(rig, kSigma_px);
    EXPECT_GE(detections.size(), 8U);
    return rig.positioner().compute_position_fix(detections, sensors);
  }
  void expect_exact(const Sensors& sensors) const {
    const Fix fix = locate(sensors);
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.body.pose.position_m, 1e-7));
    EXPECT_NEAR(fix.state.pose.yaw_rad, rig.body.pose.yaw_rad, 1e-7);
    EXPECT_NEAR(fix.state.motion.inclination.roll_rad, rig.body.motion.inclination.roll_rad, 1e-7);
    EXPECT_NEAR(fix.state.motion.inclination.pitch_rad, rig.body.motion.inclination.pitch_rad,
                1e-7);
    EXPECT_THAT(fix.state.motion.velocity_m_per_s, IsNear(rig.body.motion.velocity_m_per_s, 1e-5));
    EXPECT_NEAR(fix.state.motion.yaw_rate_rad_per_s, rig.body.motion.yaw_rate_rad_per_s, 1e-5);
  }
};

TEST_F(CameraAboveLamps, FixIsExactForCameraThatLooksStraightDown) {
  expect_exact({});
  add_mount();
  expect_exact({});
}

/// A prior of 1e6 rad does not affect the fix.
TEST_F(CameraAboveLamps, FixIsExactWithUnknownRollAndPitch) {
  rig.body.motion.inclination = {0.3, -0.2};
  rig.body.pose.position_m = {0.22, -0.57, 1.4};
  Sensors sensors;
  sensors.inclination_sigma_rad = 1e6;
  expect_exact(sensors);
  add_mount();
  expect_exact(sensors);
}

TEST_F(CameraAboveLamps, FixIsExactWithInclinationSensor) {
  rig.body.motion.inclination = {0.2, -0.1};
  rig.body.pose.position_m = {0.1, 0.3, 1.3};
  Sensors sensors;
  sensors.inclination = rig.body.motion.inclination;
  expect_exact(sensors);
  add_mount();
  expect_exact(sensors);
}

TEST_F(CameraAboveLamps, FixIsExactWithUnknownAndKnownMotion) {
  rig.body.motion.velocity_m_per_s = {0.8, -0.5};
  rig.body.motion.yaw_rate_rad_per_s = 0.6;
  add_mount();
  Sensors sensors;
  sensors.motion = KnownMotion{{0, 0}, 0, 1e4, 1e4};
  expect_exact(sensors);
  sensors.motion = KnownMotion{{0.8, -0.5}, 0.6};
  expect_exact(sensors);
}

/// States (X, Y, Z, yaw, vx, vy, yaw rate, roll, pitch) of a fix.
Eigen::VectorXd states_of(const Fix& fix) {
  const auto& [position_m, yaw_rad] = fix.state.pose;
  Eigen::VectorXd states(kBodyStates);
  states << position_m, yaw_rad, fix.state.motion.velocity_m_per_s,
      fix.state.motion.yaw_rate_rad_per_s, fix.state.motion.inclination.roll_rad,
      fix.state.motion.inclination.pitch_rad;
  return states;
}

/// Compares the covariance with derivatives of the fix with respect to every pixel.
TEST_F(CameraAboveLamps, CovarianceIsThatOfPixelNoise) {
  rig.body.motion.inclination = {0.1, -0.15};
  rig.body.pose.position_m = {0.08, -0.31, 1.5};
  Sensors sensors;
  sensors.inclination_sigma_rad = 1e6;
  sensors.motion = KnownMotion{{0, 0}, 0, 1e4, 1e4};
  auto detections = seen_from(rig, kSigma_px);
  ASSERT_EQ(detections.size(), 12U);
  const Positioner positioner = rig.positioner();
  const auto states = [&] {
    const Fix fix = positioner.compute_position_fix(detections, sensors);
    EXPECT_TRUE(fix.has_succeeded());
    return states_of(fix);
  };
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(kBodyStates, kBodyStates);
  constexpr double step_px = 0.01;
  for (Detection& detection : detections) {
    for (double& coordinate : detection.pixel) {
      const double before = coordinate;
      coordinate = before + step_px;
      const Eigen::VectorXd above = states();
      coordinate = before - step_px;
      const Eigen::VectorXd derivative = (above - states()) / (2 * step_px);
      coordinate = before;
      covariance += kSigma_px * kSigma_px * derivative * derivative.transpose();
    }
  }
  const Fix fix = positioner.compute_position_fix(detections, sensors);
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd difference =
      scale.asDiagonal() * (Eigen::MatrixXd(fix.covariance) - covariance) * scale.asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.01);
}

/// A level camera above two lamps with known errors.
class CameraAboveUncertainLamps : public CameraAboveLamps {
 protected:
  CameraAboveUncertainLamps() { rig.map.lamps.resize(2); }

  void set_lamp_covariance(const Eigen::MatrixXd& covariance) {
    JointCovariance& joint = rig.calibration.covariance.emplace();
    for (const Lamp& lamp : rig.map.lamps) {
      joint.lamps.push_back({lamp.id, lamp.position_m});
      std::ranges::move(list_lamp_parameters(lamp.id), std::back_inserter(joint.parameters));
    }
    joint.matrix = covariance;
  }

  /// Compares the covariance of the fix with that of the lamps' positions, propagated by
  /// derivatives of the fix. A dispersion offset changes with the positions.
  void expect_propagated(const Eigen::MatrixXd& lamp_covariance,
                         const Eigen::Matrix<double, 2, 6>& offset_by_lamps) const {
    constexpr double step_m = 1e-4;
    const auto detections = seen_from(rig, 1e-3);
    ASSERT_EQ(detections.size(), 2U);
    const Positioner positioner = rig.positioner();
    EXPECT_EQ(positioner.num_lamps_moved_since_calibration(), 0);
    const Fix fix = positioner.compute_position_fix(detections);
    ASSERT_TRUE(fix.has_succeeded());
    Eigen::MatrixXd derivatives(4, 6);
    for (Eigen::Index i = 0; i < 6; ++i) {
      const auto lamp = static_cast<std::size_t>(i / 3);
      BodyRig other = rig;
      other.map.lamps[lamp].position_m[i % 3] += step_m;
      if (auto& dispersion = other.calibration.dispersion) {
        dispersion->offset_px +=
            step_m *
            other.calibration.camera.focal_px().cwiseProduct(
                offset_by_lamps.middleCols<3>(3 * static_cast<Eigen::Index>(lamp)).col(i % 3));
      }
      const Pose pose = other.positioner().compute_position_fix(detections).state.pose;
      derivatives.col(i) << (pose.position_m - fix.state.pose.position_m) / step_m,
          (pose.yaw_rad - fix.state.pose.yaw_rad) / step_m;
    }
    const Eigen::Matrix4d covariance = derivatives * lamp_covariance * derivatives.transpose();
    EXPECT_LT((fix.pose_covariance() - covariance).cwiseAbs().maxCoeff(),
              0.01 * covariance.cwiseAbs().maxCoeff());
  }
};

TEST_F(CameraAboveUncertainLamps, CovarianceIncludesErrorsOfDispersionOffsetByLamps) {
  rig.calibration.dispersion = {{0.4, -0.3}, 0.001, {0, 0}, 12};
  Eigen::Matrix<double, 2, 6> jacobian;
  jacobian.leftCols<3>() << 0.5, -0.1, 0.2, 0.1, 0.6, -0.3;
  jacobian.rightCols<3>() = -0.6 * jacobian.leftCols<3>();
  const Eigen::MatrixXd covariance = 1e-4 * Eigen::MatrixXd::Identity(6, 6);
  set_lamp_covariance(covariance);
  append_parameters(*rig.calibration.covariance, list_pair_names(kOffsetParameter), jacobian,
                    Matrix2::Zero());
  expect_propagated(covariance, jacobian);
}

TEST_F(CameraAboveLamps, FixOfCLibraryIsThatOfPositioner) {
  rig.body.motion.inclination = {0.1, -0.15};
  const TemporaryFolder folder;
  write_lamp_map(folder / "lamps.yaml", rig.map);
  write_calibration(folder / "calibration.yaml", rig.calibration);
  vlp_positioner* positioner = nullptr;
  ASSERT_EQ(vlp_open((folder / "lamps.yaml").c_str(), (folder / "calibration.yaml").c_str(),
                     nullptr, &positioner),
            VLP_OK)
      << vlp_last_error();
  std::vector<vlp_detection> detections;
  for (const auto& [lamp, pixel, sigma_px] : seen_from(rig, kSigma_px))
    detections.push_back({lamp, pixel.x(), pixel.y(), sigma_px.value_or(0)});
  vlp_sensors sensors{};
  sensors.inclination_sigma_rad = 1e6;
  vlp_fix fix;
  EXPECT_EQ(vlp_locate(positioner, detections.data(), detections.size(), &sensors, &fix), VLP_OK);
  vlp_close(positioner);
  EXPECT_THAT(Eigen::Vector3d(fix.state.position_m), IsNear(rig.body.pose.position_m, 1e-7));
  EXPECT_NEAR(fix.state.yaw_rad, 0.7, 1e-7);
  EXPECT_NEAR(fix.state.roll_rad, 0.1, 1e-7);
  EXPECT_NEAR(fix.state.pitch_rad, -0.15, 1e-7);
}

}  // namespace
}  // namespace vlp
