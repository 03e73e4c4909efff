// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Limits of the variation of poses and of standard deviations, and the statistics of the result.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "calibration/tilt/drive.h"
#include "calibration/tilt/tilt_calibration.h"
#include "captures/number_text.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using testing::HasSubstr;

SyntheticRig make_rig_with_unequal_focal_lengths(double tilt_rad) {
  SyntheticRig rig = make_tilted_rig(tilt_rad, 1);
  rig.calibration.camera.intrinsics[0] = 560;
  rig.calibration.camera.intrinsics[1] = 480;
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, tilt_rad, 1);
  return rig;
}

/// Returns exact captures of a rig at poses.
std::vector<Frame> capture_at(SyntheticRig rig, const std::vector<Pose>& poses,
                              double sigma_px = 0.1) {
  std::vector<Frame> frames;
  for (const Pose& pose : poses) {
    rig.camera = pose;
    frames.push_back({std::to_string(frames.size()), seen_from(rig, sigma_px)});
  }
  return frames;
}

TiltCalibration estimate_tilt(const SyntheticRig& rig, const std::vector<Frame>& frames,
                              bool refine_map = false) {
  TiltCalibrationOptions options;
  options.refine_map = refine_map;
  return estimate_camera_tilt_from_lamps(frames, rig.map, rig.calibration.camera, options);
}

/// Captures with too few lamps (1), an unknown lamp (3), few lamps (4), an outlier (6), and a lamp
/// that is detected twice (7). Captures 1 and 7 are not used.
/// The residual before the calibration is that of the position fixes of a level camera.
TEST(EstimateCameraTiltFromLamps, ReportsCountsAndResidualsOfLevelFixes) {
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

TEST(EstimateCameraTiltFromLamps, AdjustsNoCapturesIfPosesDoNotDetermineTilt) {
  const SyntheticRig rig = make_tilted_rig(0.02, 1);
  const TiltCalibration result =
      estimate_tilt(rig, capture_at(rig, std::vector<Pose>(4, Pose{{0.1, 0.2, 0}, 1})));
  EXPECT_THAT(result.undetermined, HasSubstr("have one position and yaw"));
  EXPECT_EQ(result.captures, 0);
  EXPECT_EQ(result.captures_rejected, 4);
  EXPECT_EQ(result.detections, 0);
  EXPECT_EQ(result.detections_rejected, 32);
  EXPECT_EQ(result.residual_before_px, 0);
  EXPECT_EQ(result.covariance.size(), 0);
}

/// The limit is an RMS distance of 0.1 times the mean height of the lamps above the camera, 2 m.
TEST(EstimateCameraTiltFromLamps, RequiresPositionsThatDifferByTenthOfHeightAtOneYaw) {
  SyntheticRig rig = make_tilted_rig(0, 0);
  for (std::size_t i = 0; i < 8; ++i) {
    rig.map.lamps[i].position_m.z() = 2 + (i % 2 == 0 ? 0.1 : -0.1);
  }
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0.6, 0.8)}) {
    for (const double distance_m : {0.195, 0.205}) {
      const Eigen::Vector3d step_m = distance_m * direction;
      const auto frames = capture_at(rig, {{step_m, 1}, {-step_m, 1}, {step_m, 1}, {-step_m, 1}});
      const std::string undetermined = estimate_tilt(rig, frames).undetermined;
      if (distance_m < 0.2) {
        EXPECT_THAT(undetermined, HasSubstr("have one position and yaw"));
      } else {
        EXPECT_EQ(undetermined, "");
      }
    }
  }
}

TEST(EstimateCameraTiltFromLamps, RequiresYawsThatDifferByTenDegreesAtOnePosition) {
  const SyntheticRig rig = make_tilted_rig(0, 0);
  for (const double yaw_sd_deg : {9.8, 10.2}) {
    const double yaw_sd_rad = rad_from_deg(yaw_sd_deg);
    const auto frames =
        capture_at(rig, {{{0.1, 0, 0}, 2 + yaw_sd_rad}, {{0.1, 0, 0}, 2 - yaw_sd_rad}});
    const std::string undetermined = estimate_tilt(rig, frames).undetermined;
    if (yaw_sd_deg < 10) {
      EXPECT_THAT(undetermined, HasSubstr("have one position and yaw"));
    } else {
      EXPECT_EQ(undetermined, "");
    }
  }
}

/// The limits are 10 degrees, and 0.16 m at lamps 1.6 m above the camera.
TEST(EstimateCameraTiltFromLamps, RequiresYawsAndPositionsToDifferWhenRefiningMap) {
  const SyntheticRig rig = make_tilted_rig(0, 0);
  const auto find_reason = [&](double distance_m, double yaw_sd_deg) {
    const double yaw_sd_rad = rad_from_deg(yaw_sd_deg);
    std::vector<Pose> poses;
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector2d position_m =
          Eigen::Rotation2Dd(i * M_PI / 3) * Eigen::Vector2d(distance_m, 0);
      poses.push_back({{position_m.x(), position_m.y(), 0}, (i % 2 == 0 ? -1 : 1) * yaw_sd_rad});
    }
    return estimate_tilt(rig, capture_at(rig, poses, 1e-3), true).undetermined;
  };
  EXPECT_THAT(find_reason(0.155, 9.8), HasSubstr("have one position and yaw"));
  EXPECT_THAT(find_reason(0.165, 9.8), HasSubstr("have one yaw"));
  EXPECT_THAT(find_reason(0.155, 10.2), HasSubstr("at one position"));
  EXPECT_EQ(find_reason(0.165, 10.2), "");
}

/// Residuals: two per detection. Unknowns: four per capture, two of the zenith, and three per
/// detected lamp minus five that captures cannot determine.
TEST(EstimateCameraTiltFromLamps, RequiresRedundancyWhenRefiningMap) {
  const SyntheticRig rig = make_tilted_rig(0.02, 1);
  const auto find_reason = [&](int captures, std::size_t lamps) {
    Random random(72);
    auto frames = drive(rig, captures, random, 1e-3);
    for (Frame& frame : frames) frame.detections.resize(lamps);
    return estimate_tilt(rig, frames, true).undetermined;
  };
  const std::string undetermined = "do not determine the tilt: too few lamps";
  EXPECT_THAT(find_reason(3, 3), HasSubstr(undetermined));
  EXPECT_THAT(find_reason(2, 4), HasSubstr(undetermined));
  EXPECT_EQ(find_reason(3, 4), "");
  EXPECT_EQ(find_reason(2, 6), "");
}

/// The focal lengths differ, so that the sds of the tilt about both axes differ, too.
TEST(EstimateCameraTiltFromLamps, ReportsLargestSdOfTiltBeyondLimit) {
  Random random(73);
  const SyntheticRig rig = make_rig_with_unequal_focal_lengths(0.02);
  const auto frames = with_noise(drive(rig, 6, random, 0.5), random);
  TiltCalibrationOptions options;
  const auto estimate = [&] {
    return estimate_camera_tilt_from_lamps(frames, rig.map, rig.calibration.camera, options);
  };
  const TiltCalibration found = estimate();
  ASSERT_EQ(found.undetermined, "");
  ASSERT_EQ(found.covariance.rows(), 2);
  const double x_sd_rad = std::sqrt(found.covariance(0, 0)),
               y_sd_rad = std::sqrt(found.covariance(1, 1));
  EXPECT_GT(std::abs(x_sd_rad / y_sd_rad - 1), 0.02);
  const double sd_rad = std::max(x_sd_rad, y_sd_rad);
  options.max_sd_rad = 1.001 * sd_rad;
  EXPECT_EQ(estimate().undetermined, "");
  options.max_sd_rad = 0.999 * sd_rad;
  const TiltCalibration failed = estimate();
  EXPECT_EQ(failed.undetermined,
            "the standard deviation of the tilt would be " +
                format_significant_digits(sd_rad * 180 / M_PI, 3) +
                " degrees: add captures with more lamps, at other positions and yaws");
  EXPECT_EQ(failed.captures, 6);
}

/// Only three of ten captures detect lamp 15, whose sd is then the largest.
TEST(EstimateCameraTiltFromLamps, ReportsLampWithSdBeyondLimitWhenRefiningMap) {
  Random random(74);
  SyntheticRig rig = make_tilted_rig(0.02, 1);
  for (Lamp& lamp : rig.map.lamps) lamp.id += 10;
  auto frames = drive(rig, 10, random, 0.1);
  for (std::size_t i = 3; i < frames.size(); ++i) {
    std::erase_if(frames[i].detections, [](const Detection& seen) { return seen.lamp == 15; });
  }
  TiltCalibrationOptions options;
  options.refine_map = true;
  const auto estimate = [&] {
    return estimate_camera_tilt_from_lamps(frames, rig.map, rig.calibration.camera, options);
  };
  const TiltCalibration found = estimate();
  ASSERT_EQ(found.undetermined, "");
  ASSERT_EQ(found.corrections.size(), 8U);
  EXPECT_EQ(found.corrections[4].id, 15);
  const double sd_m = found.corrections[4].sd_m.maxCoeff();
  for (std::size_t i = 0; i < 8; ++i) {
    if (i != 4) {
      EXPECT_LT(found.corrections[i].sd_m.maxCoeff(), 0.95 * sd_m);
    }
  }
  options.max_lamp_sd_m = 1.001 * sd_m;
  EXPECT_EQ(estimate().undetermined, "");
  options.max_lamp_sd_m = 0.999 * sd_m;
  EXPECT_THAT(estimate().undetermined,
              HasSubstr("lamp 15 would have a standard deviation of " +
                        format_significant_digits(1000 * sd_m, 3) + " mm: add captures with it"));
}

TEST(EstimateCameraTiltFromLamps, NoiseScaleIsRatioOfResidualsToStatedNoiseIfAllIsStated) {
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
TEST(EstimateCameraTiltFromLamps, KeepsAllDetectionsOfTiltedCameraDespiteSmallStatedNoise) {
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
TEST(EstimateCameraTiltFromLamps, UsesCheckedCapturesAndWeightsOfUndistortedImage) {
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
    const AdjustmentResult adjusted = run_bundle_adjustment(input, {1, 1});
    EXPECT_EQ(adjusted.undetermined, "");
    return adjusted.center.zenith_in_camera;
  };
  EXPECT_THAT(result.center.zenith_in_camera, IsNear(adjust(true, true), 1e-8));
  EXPECT_GT((result.center.zenith_in_camera - adjust(true, false)).norm(), 1e-5);
  EXPECT_GT((result.center.zenith_in_camera - adjust(false, true)).norm(), 1e-5);
}

}  // namespace
}  // namespace vlp
