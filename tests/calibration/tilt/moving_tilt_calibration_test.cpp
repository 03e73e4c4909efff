// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tilt from captures of a camera that moves and rotates during readout.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "calibration/moving_captures.h"
#include "calibration/tilt/tilt_calibration.h"
#include "support/joint_covariance.h"
#include "support/matchers.h"

namespace vlp {
namespace {

TiltCalibration level(const MovingCaptures& captures, const std::vector<KnownMotion>& motions,
                      const BodyRig& rig, bool refine_map = false) {
  TiltCalibrationOptions options;
  options.motions = motions;
  options.refine_map = refine_map;
  return estimate_camera_tilt_from_lamps(captures.frames, rig.map, rig.calibration.camera, options);
}

TEST(EstimateCameraTiltFromLamps, ReturnsExactTiltForKnownAndUnknownMotion) {
  Random random(1);
  const BodyRig rig = make_tilted_body();
  const MovingCaptures captures = make_moving_captures(rig, 12, 2, random, 1e-3);
  const Eigen::Vector3d& truth = rig.calibration.rotation_center->zenith_in_camera;
  for (const bool refine_map : {false, true}) {
    const TiltCalibration known = level(captures, captures.motions, rig, refine_map);
    ASSERT_EQ(known.undetermined, "");
    EXPECT_THAT(known.center.zenith_in_camera, IsNear(truth, 1e-8));
    EXPECT_EQ(known.detections_rejected, 0);
    // The prior of the motion has a millionth of the weight of the pixels.
    const std::vector<KnownMotion> unknown(captures.frames.size(),
                                           KnownMotion::make_motion_prior_from_limits(1e3, 1e3));
    const TiltCalibration found = level(captures, unknown, rig, refine_map);
    ASSERT_EQ(found.undetermined, "");
    EXPECT_THAT(found.center.zenith_in_camera, IsNear(truth, 1e-8));
    EXPECT_LT(found.residual_px, 1e-6);
  }
}

/// A skipped capture does not shift the motions of the captures after it.
TEST(EstimateCameraTiltFromLamps, AppliesMotionOfEachCaptureWhenAnotherHasFewLamps) {
  Random random(4);
  const BodyRig rig = make_tilted_body();
  MovingCaptures captures = make_moving_captures(rig, 12, 2, random, 1e-3);
  captures.frames[2].detections.resize(2);
  const TiltCalibration found = level(captures, captures.motions, rig);
  ASSERT_EQ(found.undetermined, "");
  EXPECT_EQ(found.captures_of_few_lamps, 1);
  EXPECT_EQ(found.captures, 11);
  EXPECT_THAT(found.center.zenith_in_camera,
              IsNear(rig.calibration.rotation_center->zenith_in_camera, 1e-8));
}

TEST(EstimateCameraTiltFromLamps, TiltErrorIsTenTimesLargerWhenMotionIsIgnored) {
  Random random(2);
  const BodyRig rig = make_tilted_body();
  MovingCaptures captures = make_moving_captures(rig, 24, 1, random, 0.03);
  for (Frame& frame : captures.frames) frame.detections = with_noise(frame.detections, random);
  const Eigen::Vector3d& truth = rig.calibration.rotation_center->zenith_in_camera;
  const auto error_rad = [&](const TiltCalibration& found) {
    return (found.center.zenith_in_camera - truth).norm();
  };
  const TiltCalibration as_if_standing = level(captures, {}, rig);
  const TiltCalibration known = level(captures, captures.motions, rig);
  EXPECT_GT(error_rad(as_if_standing), 10 * error_rad(known));
  EXPECT_GT(as_if_standing.residual_px, 10 * known.residual_px);
  EXPECT_NEAR(known.residual_px, 0.035, 0.01) << "of the undistorted image";
}

/// Returns the mean of e' cov^-1 e of the zenith over drives, per unknown; 200 drives determine it
/// to 7 %.
double mean_chi_squared(const std::vector<KnownMotion>& stated, double sd_m_per_s,
                        double sd_rad_per_s, double sigma_px) {
  constexpr int draws = 200;
  Random random(3);
  const BodyRig rig = make_tilted_body();
  const MovingCaptures exact = make_moving_captures(rig, 16, 1, random, sigma_px);
  double sum = 0;
  for (int i = 0; i < draws; ++i) {
    MovingCaptures captures = exact;
    for (Frame& frame : captures.frames) frame.detections = with_noise(frame.detections, random);
    const auto motions = stated.empty()
                             ? simulate_odometry(exact.motions, sd_m_per_s, sd_rad_per_s, random)
                             : stated;
    const TiltCalibration found = level(captures, motions, rig);
    EXPECT_EQ(found.undetermined, "");
    const Eigen::Vector2d error =
        found.center.center_px - rig.calibration.rotation_center->center_px;
    sum += error.dot(center_covariance_px2(found.covariance, rig.calibration.camera).inverse() *
                     error) /
           2;
    EXPECT_LT(found.detections_rejected, 3);
    EXPECT_NEAR(found.noise_scale, 1, 0.3);
  }
  return sum / draws;
}

TEST(EstimateCameraTiltFromLamps, ZenithErrorsMatchCovarianceWithOdometry) {
  // An error of 50 mm/s moves lamps by 0.5 mm from the first row to the last.
  EXPECT_NEAR(mean_chi_squared({}, 0.05, 0.03, 0.05), 1, 0.25);
}

TEST(EstimateCameraTiltFromLamps, ZenithErrorsMatchCovarianceWithUnknownMotion) {
  EXPECT_NEAR(mean_chi_squared(
                  std::vector<KnownMotion>(16, KnownMotion::make_motion_prior_from_limits(2, 3)), 0,
                  0, 0.05),
              1, 0.25);
}

}  // namespace
}  // namespace vlp
