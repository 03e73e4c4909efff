// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Adjustment of captures of a camera that moves and rotates during readout.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calibration/adjustment/adjustment.h"
#include "calibration/moving_captures.h"
#include "geometry/frames.h"
#include "rig/calibration_error.h"
#include "support/matchers.h"

namespace vlp {
namespace {

const Eigen::Vector2d kArm_m(0.009, -0.004);
constexpr double kPlaceSd_m = 1e-4;

/// Returns captures of a moving camera with known positions of the axis.
AdjustmentInput tracked_drive(const BodyRig& rig, const MovingCaptures& captures,
                              const std::vector<KnownMotion>& motions) {
  AdjustmentInput input{{}, rig.map, rig.calibration};
  input.calibration.rotation_center.reset();
  for (Lamp& lamp : input.lamps.lamps) lamp.sd_m = 0.001;
  for (std::size_t i = 0; i < captures.frames.size(); ++i) {
    const Pose& camera = captures.cameras[i];
    AdjustmentCapture capture{captures.frames[i].image, captures.frames[i].detections};
    Eigen::Vector3d arm_m(kArm_m.x(), kArm_m.y(), 0);
    const Eigen::Vector3d axis_m = camera.position_m - rotation_about_z(camera.yaw_rad) * arm_m;
    capture.known_position =
        KnownPosition{MeasuredPoint::axis, axis_m.head<2>(), axis_m.z(), kPlaceSd_m};
    if (!motions.empty()) capture.motion = motions[i];
    input.captures.push_back(capture);
  }
  return input;
}

/// Returns the errors of zenith point and lever arm.
Eigen::Vector4d compute_error(const AdjustmentResult& found, const BodyRig& rig) {
  Eigen::Vector4d error;
  error << compute_zenith_point(found.center) -
               compute_zenith_point(*rig.calibration.rotation_center),
      found.center.lever_arm_m.value() - kArm_m;
  return error;
}

TEST(AdjustBundle, RecoversZenithAndLeverArmExactlyForMovingCamera) {
  Random random(1);
  const BodyRig rig = make_tilted_body();
  const MovingCaptures captures = make_moving_captures(rig, 16, 2, random, 1e-3);
  const AdjustmentResult known = adjust_bundle(tracked_drive(rig, captures, captures.motions));
  ASSERT_TRUE(known.has_succeeded()) << known.undetermined;
  ASSERT_TRUE(known.center.lever_arm_m);
  EXPECT_THAT(compute_error(known, rig), IsNear(Eigen::Vector4d(0, 0, 0, 0), 1e-9));
  EXPECT_LT(known.residual_px, 1e-8);
  const std::vector<KnownMotion> unknown(16, KnownMotion::make_motion_prior_from_limits(1e3, 1e3));
  const AdjustmentResult found = adjust_bundle(tracked_drive(rig, captures, unknown));
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_THAT(compute_error(found, rig), IsNear(Eigen::Vector4d(0, 0, 0, 0), 1e-8));
}

/// Rotation in place without stops.
TEST(AdjustBundle, RecoversZenithAndLeverArmWhileRotatingWithKnownYawRate) {
  BodyRig rig = make_tilted_body();
  const double rate_rad_per_s = 2;
  const auto turned = [&](double stated_rad_per_s) {
    AdjustmentInput input = tracked_drive(rig, {}, {});
    for (const Eigen::Vector3d& axis_m :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.3, 0.1, 0.3)}) {
      for (int k = 0; k < 12; ++k) {
        const double yaw_rad = 0.3 + k * M_PI / 6;
        const Eigen::Vector3d arm_m(kArm_m.x(), kArm_m.y(), 0);
        rig.body.pose = {axis_m + rotation_about_z(yaw_rad) * arm_m, yaw_rad};
        // The camera moves on its arm. The curvature of its path, w^2 t^2 / 2 of it, is not in
        // BodyRig.
        rig.body.motion = {
            rate_rad_per_s * Eigen::Vector2d(-kArm_m.y(), kArm_m.x()), rate_rad_per_s, {0, 0}};
        AdjustmentCapture capture{std::to_string(input.captures.size()), seen_from(rig, 0.03)};
        capture.pivot = axis_m.z() > 0 ? "high" : "low";
        capture.motion.yaw_rate_rad_per_s = stated_rad_per_s;
        input.captures.push_back(capture);
      }
    }
    const AdjustmentResult found = adjust_bundle(input);
    EXPECT_TRUE(found.has_succeeded()) << found.undetermined;
    return found;
  };
  const AdjustmentResult known = turned(rate_rad_per_s);
  EXPECT_LT(known.residual_px, 0.01);
  EXPECT_THAT(compute_error(known, rig), IsNear(Eigen::Vector4d(0, 0, 0, 0), 1e-5));
  EXPECT_GT(turned(0).residual_px, 1) << "two degrees from the first row to the last";
}

TEST(AdjustBundle, ReportsContradictedNoiseWhenMotionIsIgnored) {
  Random random(2);
  const BodyRig rig = make_tilted_body();
  MovingCaptures captures = make_moving_captures(rig, 16, 1, random, 0.05);
  for (Frame& frame : captures.frames) frame.detections = with_noise(frame.detections, random);
  const AdjustmentResult known = adjust_bundle(tracked_drive(rig, captures, captures.motions));
  const AdjustmentResult left_out = adjust_bundle(tracked_drive(rig, captures, {}));
  ASSERT_TRUE(known.has_succeeded() && left_out.has_succeeded());
  EXPECT_FALSE(known.noise_is_contradicted);
  EXPECT_GT(left_out.noise_scale, 5);
  EXPECT_TRUE(left_out.noise_is_contradicted);
  EXPECT_GT(compute_error(left_out, rig).norm(), 3 * compute_error(known, rig).norm());
}

/// Mean normalized squared error e' cov^-1 e of zenith and lever arm per unknown; 60 draws
/// determine it to 10 %.
TEST(AdjustBundle, ZenithAndLeverArmErrorsMatchCovarianceForMovingCamera) {
  constexpr int draws = 60;
  const BodyRig rig = make_tilted_body();
  for (const bool odometry : {true, false}) {
    Random random(4);
    const MovingCaptures exact = make_moving_captures(rig, 16, 1, random, 0.05);
    double sum = 0;
    for (int i = 0; i < draws; ++i) {
      MovingCaptures captures = exact;
      for (Frame& frame : captures.frames) frame.detections = with_noise(frame.detections, random);
      const auto motions =
          odometry ? simulate_odometry(exact.motions, 0.05, 0.03, random)
                   : std::vector<KnownMotion>(16, KnownMotion::make_motion_prior_from_limits(2, 3));
      const auto judged = [&](AdjustmentInput input) {
        for (std::size_t k = 0; k < input.lamps.lamps.size(); ++k) {
          for (double& one : input.lamps.lamps[k].position_m) one += 0.001 * random.normal();
        }
        for (AdjustmentCapture& capture : input.captures) {
          for (double& one : capture.known_position->xy_m) one += kPlaceSd_m * random.normal();
          *capture.known_position->z_m += kPlaceSd_m * random.normal();
        }
        const AdjustmentResult found = adjust_bundle(input);
        EXPECT_TRUE(found.has_succeeded() && found.center.lever_arm_m) << found.undetermined;
        const Eigen::Index zenith = std::ssize(rig.calibration.camera.intrinsics);
        const Eigen::Matrix4d covariance = found.refined_covariance.block<4, 4>(zenith, zenith);
        const Eigen::Vector4d error = compute_error(found, rig);
        return error.dot(covariance.ldlt().solve(error)) / 4;
      };
      sum += judged(tracked_drive(rig, captures, motions));
    }
    EXPECT_NEAR(sum / draws, 1, 0.3) << odometry;
  }
}

}  // namespace
}  // namespace vlp
