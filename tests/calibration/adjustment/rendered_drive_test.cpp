// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tilt and lever arm from rendered images of a moving camera, detected and solved as in the
/// programs. Compared with those from a stationary camera at the same positions.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdio>

#include "calibration/adjustment/adjustment.h"
#include "calibration/tilt/tilt_calibration.h"
#include "frontend/mat_view.h"
#include "geometry/angles.h"
#include "lamps/light_detector.h"
#include "simulation/exposure.h"
#include "simulation/truth.h"
#include "support/random.h"

namespace vlp {
namespace {

/// Captures under the lamps of datasets/paper-rig, with a row time of 55 us.
class RenderedDriveCalibration : public testing::Test {
 protected:
  static constexpr int kCaptures = 32;
  /// Number of captures of the first set of the scene, whose motions are replaced.
  static constexpr std::size_t kShots = 12;
  static constexpr double kPlaceSd_m = 1e-4, kMapSd_m = 1e-4;

  Scene scene = [] {
    Scene rig = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
    rig.camera.row_time_s = 55e-6;
    rig.sets.at(0).lamps->yaws_rad.assign(kShots, 0);  // drive() replaces the yaws
    return rig;
  }();
  const Calibration truth = make_true_calibration(scene);
  const LampMap lamps = make_lamp_map(scene, false);

  struct Drive {
    std::vector<Frame> frames;
    std::vector<KnownMotion> motions;
    /// Position of the axis in each capture.
    std::vector<Eigen::Vector3d> places_m;
  };

  Drive drive(double speed_m_per_s) const {
    const FrameRenderer renderer(scene);
    const LightDetector detector(lamps, make_detector_camera(truth));
    Random random(5);
    Drive drive;
    for (int i = 0; i < kCaptures; ++i) {
      LampShot shot = make_lamp_shot(scene, scene.sets.at(0), static_cast<std::size_t>(i) % kShots);
      BaseMotion& motion = shot.motion;
      motion.axis_m = {random.uniform(-0.3, 0.3), random.uniform(-0.12, 0.12), i % 2 ? 0.3 : 0.0};
      motion.yaw_rad = random.uniform(-3.1, 3.1);
      const double direction_rad = random.uniform(-3.1, 3.1);
      const double rate_rad_per_s = rad_from_deg(random.uniform(-90, 90));
      motion.velocity_m_per_s =
          speed_m_per_s * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
      motion.turn_rate_rad_per_s = speed_m_per_s > 0 ? rate_rad_per_s : 0;
      const cv::Mat image =
          simulate_sensor_image(scene.sensor, renderer.render_lamps(shot), shot.noise_seed);
      Frame frame{std::to_string(i), {}};
      for (const Light& light : detector.detect_lights(to_image_view(image))) {
        if (light.kind != LightKind::lamp) continue;
        frame.detections.push_back({*light.lamp, light.pixel, light.sigma_px});
      }
      drive.frames.push_back(frame);
      drive.motions.push_back(
          {Eigen::Rotation2Dd(-motion.yaw_rad) * motion.camera_velocity_m_per_s(),
           motion.turn_rate_rad_per_s, 0, 0});
      drive.places_m.push_back(motion.axis_m);
    }
    return drive;
  }

  std::vector<KnownMotion> simulate_odometry(const Drive& drive, double relative_error) const {
    Random random(6);
    std::vector<KnownMotion> read = drive.motions;
    for (KnownMotion& motion : read) {
      motion.velocity_sd_m_per_s = relative_error * motion.velocity_m_per_s.norm();
      motion.yaw_rate_sd_rad_per_s = relative_error * std::abs(motion.yaw_rate_rad_per_s);
      for (double& one : motion.velocity_m_per_s)
        one += motion.velocity_sd_m_per_s * random.normal();
      motion.yaw_rate_rad_per_s += motion.yaw_rate_sd_rad_per_s * random.normal();
    }
    return read;
  }

  struct Found {
    double zenith_rad, zenith_sd_rad, arm_m, arm_sd_m;
  };
  Found level(const Drive& drive, const std::vector<KnownMotion>& motions) const {
    TiltCalibrationOptions options;
    options.motions = motions;
    const TiltCalibration found =
        estimate_tilt_from_lamps(drive.frames, lamps, scene.camera, options);
    EXPECT_EQ(found.undetermined, "");
    return {zenith_error(found.center), std::sqrt(found.covariance.trace()), 0, 0};
  }
  Found adjust(const Drive& drive, const std::vector<KnownMotion>& motions) const {
    AdjustmentInput input{{}, lamps, {}};
    input.calibration.camera = scene.camera;
    for (Lamp& lamp : input.lamps.lamps) lamp.sd_m = kMapSd_m;
    for (std::size_t i = 0; i < drive.frames.size(); ++i) {
      const Eigen::Vector3d& place_m = drive.places_m[i];
      AdjustmentCapture capture{drive.frames[i].image, drive.frames[i].detections};
      capture.known_position =
          KnownPosition{MeasuredPoint::axis, place_m.head<2>(), place_m.z(), kPlaceSd_m};
      if (!motions.empty()) capture.motion = motions[i];
      input.captures.push_back(capture);
    }
    const AdjustmentResult found = adjust_bundle(input);
    EXPECT_TRUE(found.has_succeeded() && found.center.lever_arm_m) << found.undetermined;
    if (!found.center.lever_arm_m) return {};
    const MatrixX covariance = found.center_covariance;
    return {zenith_error(found.center), std::sqrt(covariance.topLeftCorner<2, 2>().trace()),
            (*found.center.lever_arm_m - scene.mount.lever_arm_m).norm(),
            std::sqrt(covariance.bottomRightCorner<2, 2>().trace())};
  }
  double zenith_error(const RotationCenter& center) const {
    return (center.zenith_in_camera - truth.rotation_center->zenith_in_camera).norm();
  }
  static void print(const char* what, const Found& found) {
    std::printf("%-28s zenith %.5f deg (sd %.5f), lever arm %.4f mm (sd %.4f)\n", what,
                deg_from_rad(found.zenith_rad), deg_from_rad(found.zenith_sd_rad),
                1e3 * found.arm_m, 1e3 * found.arm_sd_m);
  }
};

/// Number of standard deviations, of two angles together, that one error in a hundred exceeds.
constexpr double kFar = 3;

TEST_F(RenderedDriveCalibration, TiltFromLampsMatchesTruthForMovingCamera) {
  const Drive standing = drive(0), driving = drive(1);
  const Found of_standing = level(standing, {});
  const Found with_odometry = level(driving, simulate_odometry(driving, 0.01));
  const Found unknown = level(
      driving, std::vector<KnownMotion>(
                   kCaptures, KnownMotion::make_motion_prior_from_limits(2, rad_from_deg(180))));
  const Found left_out = level(driving, {});
  print("standing, leveled", of_standing);
  print("1 m/s, odometry 1 %", with_odometry);
  print("1 m/s, unknown", unknown);
  print("1 m/s, left out", left_out);
  for (const Found& found : {of_standing, with_odometry, unknown}) {
    EXPECT_LT(found.zenith_rad, kFar * found.zenith_sd_rad);
    EXPECT_LT(found.zenith_rad, rad_from_deg(0.02));
  }
  EXPECT_GT(left_out.zenith_rad, 5 * with_odometry.zenith_rad);
}

TEST_F(RenderedDriveCalibration, AdjustedTiltAndLeverArmMatchTruthForMovingCamera) {
  const Drive standing = drive(0), driving = drive(1);
  const Found of_standing = adjust(standing, {});
  const Found with_odometry = adjust(driving, simulate_odometry(driving, 0.01));
  const Found unknown = adjust(
      driving, std::vector<KnownMotion>(
                   kCaptures, KnownMotion::make_motion_prior_from_limits(2, rad_from_deg(180))));
  const Found left_out = adjust(driving, {});
  print("standing, adjusted", of_standing);
  print("1 m/s, odometry 1 %", with_odometry);
  print("1 m/s, unknown", unknown);
  print("1 m/s, left out", left_out);
  for (const Found& found : {of_standing, with_odometry, unknown}) {
    EXPECT_LT(found.zenith_rad, kFar * found.zenith_sd_rad);
    EXPECT_LT(found.arm_m, kFar * found.arm_sd_m);
    EXPECT_LT(found.arm_m, 1e-4);
  }
  EXPECT_GT(left_out.arm_m, 5 * with_odometry.arm_m);
}

}  // namespace
}  // namespace vlp
