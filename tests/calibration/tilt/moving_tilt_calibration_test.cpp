// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tilt from captures of a camera that moves and rotates during readout.
#include <gtest/gtest.h>

#include "calibration/moving_captures.h"
#include "calibration/tilt/tilt_calibration.h"
#include "support/estimate_scatter.h"
#include "support/matchers.h"

namespace vlp {
namespace {

TiltCalibration level(const MovingCaptures& captures, const std::vector<KnownMotion>& motions,
                      const BodyRig& rig, bool refine_map = false) {
  TiltCalibrationOptions options;
  options.motions = motions;
  options.refine_map = refine_map;
  return estimate_tilt_from_lamps(captures.frames, rig.map, rig.calibration.camera, options);
}

TEST(EstimateTiltFromLamps, ReturnsExactTiltForKnownAndUnknownMotion) {
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
TEST(EstimateTiltFromLamps, AssignsMotionsCorrectlyAfterSkippedCapture) {
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

TEST(EstimateTiltFromLamps, TiltErrorIsTenTimesLargerWhenMotionIsIgnored) {
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

class EstimateTiltOfMovingCamera : public testing::TestWithParam<bool> {};

/// 150 drives determine the mean of e' C^-1 e of the zenith to 8 %. An error of 50 mm/s of the
/// odometry moves lamps by 0.5 mm from the first row to the last.
TEST_P(EstimateTiltOfMovingCamera, ZenithErrorsMatchReportedCovariance) {
  Random random(3);
  const BodyRig rig = make_tilted_body();
  const MovingCaptures exact = make_moving_captures(rig, 16, 1, random, 0.05);
  EstimateScatter scatter;
  for (int i = 0; i < 150; ++i) {
    MovingCaptures captures = exact;
    for (Frame& frame : captures.frames) frame.detections = with_noise(frame.detections, random);
    const auto motions =
        GetParam() ? simulate_odometry(exact.motions, 0.05, 0.03, random)
                   : std::vector<KnownMotion>(16, KnownMotion::make_motion_prior_from_limits(2, 3));
    const TiltCalibration found = level(captures, motions, rig);
    ASSERT_EQ(found.undetermined, "");
    scatter.add(found.center.zenith_in_camera.hnormalized() -
                    rig.calibration.rotation_center->zenith_in_camera.hnormalized(),
                found.covariance);
    EXPECT_LT(found.detections_rejected, 3);
    EXPECT_NEAR(found.noise_scale, 1, 0.3);
  }
  EXPECT_NEAR(scatter.mean_mahalanobis_square(), 1, 0.25);
}

INSTANTIATE_TEST_SUITE_P(Motion, EstimateTiltOfMovingCamera, testing::Bool(),
                         [](const auto& one) { return one.param ? "Odometry" : "Unknown"; });

}  // namespace
}  // namespace vlp
