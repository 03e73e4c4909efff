// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Statistics of the result, and settings of the adjustment.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "calibration/tilt/drive.h"
#include "calibration/tilt/tilt_calibration.h"
#include "positioning/positioner.h"
#include "support/matchers.h"

namespace vlp {
namespace {

SyntheticRig make_rig_with_unequal_focal_lengths(double tilt_rad) {
  SyntheticRig rig = make_tilted_rig(tilt_rad, 1);
  rig.calibration.camera.intrinsics[0] = 560;
  rig.calibration.camera.intrinsics[1] = 480;
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, tilt_rad, 1);
  return rig;
}

TiltCalibration estimate_tilt(const SyntheticRig& rig, const std::vector<Frame>& frames,
                              bool refine_map = false) {
  TiltCalibrationOptions options;
  options.refine_map = refine_map;
  return estimate_tilt_from_lamps(frames, rig.map, rig.calibration.camera, options);
}

/// Captures with too few lamps (1), an unknown lamp (3), few lamps (4), an outlier (6), and a lamp
/// that is detected twice (7). Captures 1 and 7 are not used.
/// The residual before the calibration is that of the position fixes of a level camera.
TEST(EstimateTiltFromLamps, ReportsCountsAndResidualsOfLevelFixes) {
  Random random(71);
  const SyntheticRig rig = make_rig_with_unequal_focal_lengths(0.02);
  auto frames = with_noise(drive(rig, 9, random, 0.1), random);
  frames[1].detections.resize(2);
  frames[1].detections.push_back({99, {100, 100}, 0.1});
  frames[3].detections.push_back({98, {100, 100}, 0.1});
  frames[4].detections.resize(5);
  frames[6].detections[2].pixel.x() += 60;
  frames[7].detections.push_back(frames[7].detections[0]);
  const TiltCalibration result = estimate_tilt(rig, frames);
  ASSERT_EQ(result.undetermined, "");
  EXPECT_EQ(result.captures_of_few_lamps, 1);
  EXPECT_EQ(result.captures, 7);
  EXPECT_EQ(result.captures_rejected, 1);
  EXPECT_EQ(result.detections, 5 * 8 + 5 + 7);
  EXPECT_EQ(result.detections_rejected, 1 + 9) << "the outlier, and all of capture 7";

  Calibration level;
  level.camera = rig.calibration.camera;
  const Positioner positioner(rig.map, level);
  double squares_px2 = 0, freedom = 0;
  for (const Frame& frame : frames) {
    if (frame.detections.size() == 3) continue;
    auto detections = frame.detections;
    for (Detection& detection : detections) detection.sigma_px.reset();
    const Fix fix = positioner.compute_position_fix(detections);
    if (!fix.has_succeeded()) continue;
    squares_px2 += fix.lamps * fix.residual_px * fix.residual_px;
    freedom += 2 * fix.lamps - 4;
  }
  EXPECT_EQ(freedom, 2 * result.detections - 4 * result.captures);
  EXPECT_GT(squares_px2 / freedom, 1);
  EXPECT_NEAR(result.residual_before_px, std::sqrt(squares_px2 / freedom), 1e-9);
  EXPECT_NEAR(result.residual_px, 0.1, 0.03);
  EXPECT_TRUE(result.corrections.empty());
  ASSERT_EQ(result.map.lamps.size(), 8U);
  EXPECT_EQ(result.map.lamps[3].position_m, rig.map.lamps[3].position_m);
}

TEST(EstimateTiltFromLamps, NoiseScaleIsRatioOfResidualsToStatedNoiseIfAllIsStated) {
  Random random(75);
  const SyntheticRig rig = make_tilted_rig(0.02, 1);
  auto frames = with_noise(drive(rig, 20, random, 0.3), random);
  for (Frame& frame : frames) {
    for (Detection& detection : frame.detections) detection.sigma_px = 0.1;
  }
  const TiltCalibration stated = estimate_tilt(rig, frames);
  ASSERT_EQ(stated.undetermined, "");
  EXPECT_NEAR(stated.noise_scale, 3, 0.5);
  frames[19].detections.back().sigma_px.reset();
  const TiltCalibration unstated = estimate_tilt(rig, frames);
  ASSERT_EQ(unstated.undetermined, "");
  EXPECT_EQ(unstated.noise_scale, 1);
}

/// The residuals of a level camera exceed the stated noise of pixels and lamps by far.
TEST(EstimateTiltFromLamps, KeepsAllDetectionsOfTiltedCameraDespiteSmallStatedNoise) {
  Random random(76);
  SyntheticRig rig = make_tilted_rig(0.06, 1);
  for (Lamp& lamp : rig.map.lamps) lamp.sd_m = 1e-4;
  const TiltCalibration result = estimate_tilt(rig, drive(rig, 10, random, 1e-3));
  ASSERT_EQ(result.undetermined, "");
  EXPECT_EQ(result.captures, 10);
  EXPECT_EQ(result.detections, 80);
  EXPECT_EQ(result.detections_rejected, 0);
  EXPECT_THAT(result.center.zenith_in_camera,
              IsNear(rig.calibration.rotation_center->zenith_in_camera, 1e-8));
  EXPECT_GT(result.residual_before_px, 1);
}

/// An exact lamp with a wrong position stays in use, and detections without sigma_px have equal
/// weights in the undistorted image. Other settings of the adjustment give another zenith.
TEST(EstimateTiltFromLamps, AdjustsCheckedCapturesWeightedInUndistortedImage) {
  Random random(77);
  SyntheticRig rig = make_tilted_rig(0.01, 1);
  auto frames = with_noise(drive(rig, 8, random, 0.2), random);
  for (Frame& frame : frames) {
    for (Detection& detection : frame.detections) detection.sigma_px.reset();
  }
  rig.map.lamps[3].position_m.x() += 0.02;
  const TiltCalibration result = estimate_tilt(rig, frames);
  ASSERT_EQ(result.undetermined, "");
  const auto adjust = [&](bool checked, bool undistorted) {
    AdjustmentInput input{{}, rig.map, {}};
    input.calibration.camera = rig.calibration.camera;
    for (const Frame& frame : frames) input.captures.push_back({frame.image, frame.detections});
    input.captures_are_checked = checked;
    input.weighs_in_undistorted_image = undistorted;
    const AdjustmentResult adjusted = adjust_bundle(input, {1, 1});
    EXPECT_EQ(adjusted.undetermined, "");
    return adjusted.center.zenith_in_camera;
  };
  EXPECT_THAT(result.center.zenith_in_camera, IsNear(adjust(true, true), 1e-8));
  EXPECT_GT((result.center.zenith_in_camera - adjust(true, false)).norm(), 1e-5);
  EXPECT_GT((result.center.zenith_in_camera - adjust(false, true)).norm(), 1e-5);
}

}  // namespace
}  // namespace vlp
