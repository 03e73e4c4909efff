// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Captures that do not determine the tilt, and the reported reasons.
#include <gmock/gmock.h>

#include "calibration/tilt/drive.h"
#include "calibration/tilt/tilt_calibration.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class EstimateTiltFromLampsFailure : public testing::Test {
 protected:
  Random random{31};
  SyntheticRig rig = make_tilted_rig(0.05, 1);

  std::string rejection_message(const std::vector<Frame>& frames, bool refine_map = false) {
    TiltCalibrationOptions options;
    options.refine_map = refine_map;
    return estimate_camera_tilt_from_lamps(with_noise(frames, random), rig.map,
                                           rig.calibration.camera, options)
        .undetermined;
  }
  Frame seen_at(const Eigen::Vector3d& position_m, double yaw_rad) {
    rig.camera = {position_m, yaw_rad};
    return {"", seen_from(rig, 0.1)};
  }
};

TEST_F(EstimateTiltFromLampsFailure, ReportsUndeterminedForNoneOrOneCapture) {
  EXPECT_THAT(rejection_message({}), HasSubstr("there is none"));
  EXPECT_THAT(rejection_message(drive(rig, 1, random, 0.1)), HasSubstr("there is one"));
}

TEST_F(EstimateTiltFromLampsFailure,
       ReportsNoUsableCaptureForTwoLampsPerCaptureUnknownIdsOrMirroredMap) {
  auto frames = drive(rig, 20, random, 0.1);
  for (Frame& frame : frames) frame.detections.resize(2);
  EXPECT_THAT(rejection_message(frames), HasSubstr("there is none"));
  frames = drive(rig, 20, random, 0.1);
  for (Lamp& lamp : rig.map.lamps) lamp.id += 100;
  EXPECT_THAT(rejection_message(frames), HasSubstr("there is none"));
  rig.map = synthetic_lamps();
  for (Lamp& lamp : rig.map.lamps) lamp.position_m.y() = -lamp.position_m.y();
  EXPECT_THAT(rejection_message(frames), HasSubstr("there is none")) << "mirrored";
}

TEST_F(EstimateTiltFromLampsFailure, RequestsMoreCapturesForCollinearLampsAtOneYaw) {
  rig.map = make_lamp_map({{-0.8, 0, 1.6}, {0, 0, 1.6}, {0.8, 0, 1.6}, {0.3, 0, 1.6}});
  std::vector<Frame> along;
  for (int i = 0; i < 12; ++i) along.push_back(seen_at({-0.5 + 0.1 * i, 0.05 * i - 0.3, 0}, 1));
  EXPECT_THAT(rejection_message(along), HasSubstr("add captures"));
}

TEST_F(EstimateTiltFromLampsFailure, RequestsTurningCameraForIdenticalCaptures) {
  const Frame frame = seen_at({0.1, 0.1, 0}, 1);
  EXPECT_THAT(rejection_message({20, frame}), HasSubstr("turn the camera"));
}

TEST_F(EstimateTiltFromLampsFailure, ReportsOneYawOrOnePositionOnlyWhenRefiningMap) {
  std::vector<Frame> along, around;
  for (int i = 0; i < 12; ++i) {
    along.push_back(seen_at({-0.5 + 0.1 * i, 0.05 * i - 0.3, 0.02 * i}, 1));
    around.push_back(seen_at({0.1, -0.1, 0}, 0.5 * i));
  }
  EXPECT_EQ(rejection_message(along), "");
  EXPECT_EQ(rejection_message(around), "");
  EXPECT_THAT(rejection_message(along, true), HasSubstr("have one yaw"));
  EXPECT_THAT(rejection_message(around, true), HasSubstr("at one position"));
}

TEST_F(EstimateTiltFromLampsFailure, ReportsTooLargeSdOfTiltOrRefinedLamp) {
  auto frames = drive(rig, 3, random, 8);
  EXPECT_THAT(rejection_message(frames), HasSubstr(" degrees: add captures"));
  frames = drive(rig, 12, random, 0.9);
  EXPECT_EQ(rejection_message(frames, true), "");
  for (std::size_t i = 2; i < frames.size(); ++i) {
    std::erase_if(frames[i].detections, [](const Detection& seen) { return seen.lamp == 3; });
  }
  EXPECT_THAT(rejection_message(frames, true),
              HasSubstr("lamp 3 would have a standard deviation of"));
  std::erase_if(frames[1].detections, [](const Detection& seen) { return seen.lamp == 3; });
  EXPECT_THAT(rejection_message(frames, true), HasSubstr("lamp 3 is in one capture only"));
}

TEST_F(EstimateTiltFromLampsFailure, RejectsOnlyCaptureWithDuplicateLamp) {
  auto frames = drive(rig, 10, random, 0.1);
  frames[3].detections.push_back(frames[3].detections.front());
  const auto result = estimate_camera_tilt_from_lamps(frames, rig.map, rig.calibration.camera);
  EXPECT_EQ(result.undetermined, "");
  EXPECT_EQ(result.captures_rejected, 1);
}

}  // namespace
}  // namespace vlp
