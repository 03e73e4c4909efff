// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/locate_step.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <utility>

#include "rig/calibration_error.h"
#include "support/body_rig.h"
#include "support/datasets.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

LocateInput example() {
  return {read_detections(kExample + "detections.csv"), read_lamp_map(kExample + "lamps.yaml"),
          read_calibration(kExample + "calibration.yaml")};
}

TEST(LocateFromDetections, ReturnsFixForEachFrameOfExample) {
  const LocateResult found = locate_from_detections(example());
  EXPECT_TRUE(found.has_succeeded());
  EXPECT_EQ(found.summary.fixes, found.rows.size());
  EXPECT_THAT(found.warnings, IsEmpty());
  EXPECT_THAT(found.rejected_lamps, IsEmpty());
}

TEST(LocateFromDetections, CountsDetectionsOfLampsMissingInMap) {
  LocateInput input = example();
  ASSERT_GT(input.frames.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) input.frames[i].detections.push_back({99, {400, 300}, 0.05});
  EXPECT_THAT(locate_from_detections(input).warnings,
              ElementsAre("2 detections of lamps not in the map, rejected"));
}

TEST(LocateFromDetections, WarnsOfTiltedCameraUnlessTiltIsEstimated) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  LocateInput input{{}, rig.map, rig.calibration};
  rig.body.motion.inclination = {0.03, -0.04};
  for (int i = 0; i < 12; ++i) {
    rig.body.pose = {{0.05 * i - 0.3, -0.02 * i, 0}, 0.5 * i};
    input.frames.push_back({std::to_string(i), seen_from(rig, 0.02)});
  }
  const auto warning = HasSubstr(
      "the images fit a tilted camera, by 2.9 degrees: state "
      "inclinations in captures.csv, or --roll-pitch-sd-deg");
  EXPECT_THAT(locate_from_detections(input).warnings, testing::Contains(warning));
  input.roll_pitch_sd_rad = 0.1;
  EXPECT_THAT(locate_from_detections(input).warnings, Not(testing::Contains(warning)));
}

TEST(LocateFromDetections, LampOffsetsEqualDisplacementOfMovedLamp) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  LocateInput input{{}, rig.map, rig.calibration};
  const Eigen::Vector2d moved_m(1e-3, -2e-3);
  rig.map.lamps.front().position_m.head<2>() += moved_m;
  for (int i = 0; i < 4; ++i) {
    rig.body.pose = {{0.1 * i, -0.05 * i, 0}, 1.5 * i};
    input.frames.push_back({std::to_string(i), seen_from(rig, 0.05)});
  }
  input.frames.push_back({"twice", input.frames.back().detections});
  input.frames.back().detections.push_back(input.frames.back().detections.front());
  EXPECT_THAT(locate_from_detections(input).lamp_offsets, IsEmpty()) << "was not asked";
  input.compute_lamp_offsets = true;
  const auto offsets = locate_from_detections(input).lamp_offsets;
  ASSERT_EQ(offsets.size(), rig.map.lamps.size());
  for (const LampOffset& offset : offsets) {
    const auto seen =
        std::count_if(input.frames.begin(), input.frames.end(), [&](const Frame& frame) {
          return std::count_if(frame.detections.begin(), frame.detections.end(),
                               [&](const Detection& one) { return one.lamp == offset.lamp; }) == 1;
        });
    EXPECT_EQ(offset.captures, seen) << "not where a lamp is seen twice";
    if (offset.lamp == rig.map.lamps.front().id) {
      EXPECT_LT((offset.offset_m - moved_m).norm(), 1e-8) << offset.offset_m.transpose();
      EXPECT_LT(offset.sd_m.norm(), 1e-6);
    } else {
      EXPECT_LT(offset.offset_m.norm(), moved_m.norm());
    }
  }
}

/// 36 captures of a surveyed room by a camera whose zenith and lens are known; 12 of them see lamp
/// 2, which hangs elsewhere than the map says.
LocateInput room_with_a_moved_lamp(double by_m) {
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {}, {}};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.02, 1);
  LocateInput input{{}, rig.map, rig.calibration};
  MatrixX covariance = MatrixX::Zero(12 + 4 + 24, 12 + 4 + 24);
  covariance.diagonal().tail<24>().setConstant(1e-3 * 1e-3);
  std::vector<JointCovariance::LampPosition> lamps;
  for (const Lamp& lamp : rig.map.lamps) lamps.push_back({lamp.id, lamp.position_m});
  input.calibration.adjustment = Adjustment{{"made up"}, 1, 1, 0.1};
  input.calibration.covariance = make_covariance(input.calibration.camera, lamps, covariance);
  rig.map.lamps[1].position_m.x() += by_m;
  Random random(5);
  for (int i = 0; i < 36; ++i) {
    const double x_m = random.uniform(-0.3, 0.3), y_m = random.uniform(-0.1, 0.1);
    rig.camera = {{x_m, y_m, 0}, 0.1 * i};
    std::vector<Detection> seen = with_noise(seen_from(rig, 0.05), random);
    if (i >= 12) std::erase_if(seen, [](const Detection& one) { return one.lamp == 2; });
    input.frames.push_back({std::to_string(i), seen});
  }
  return input;
}

TEST(LocateFromDetections, WarnsOfMovedLampAndItsDisplacement) {
  const LocateResult found = locate_from_detections(room_with_a_moved_lamp(0.03));
  EXPECT_THAT(found.warnings,
              testing::Contains("lamp 2 hangs 30 mm from where the map has it (x +30 mm, y +0 mm): "
                                "moved, or entered wrongly"));
  EXPECT_EQ(found.warnings.size(), 1U) << "its rejections are not counted apart";
  ASSERT_EQ(found.rejected_lamps.size(), 1U);
  EXPECT_EQ(found.rejected_lamps[0].lamp, 2);
  ASSERT_TRUE(found.rows[0].fix && found.rows[0].fix->noise_sd);
  EXPECT_LT((*found.rows[0].fix->noise_sd)[0], (*found.rows[0].fix->sd)[0]);
  for (std::size_t i = 0; i < 36; ++i) {
    EXPECT_THAT(found.rows[i].rejected_lamps,
                testing::ElementsAreArray(std::vector<int>(i < 12 ? 1U : 0U, 2)));
  }
  EXPECT_THAT(locate_from_detections(room_with_a_moved_lamp(0)).rejected_lamps, IsEmpty());
}

TEST(LocateFromDetections, RollOfCapturesTableMovesFixAlongY) {
  LocateInput input = example();
  const LocateResult level = locate_from_detections(input);
  ASSERT_FALSE(level.rows.empty());
  ASSERT_TRUE(level.rows[0].fix);
  const Eigen::Vector3d level_m = level.rows[0].fix->pose.position_m;
  Capture leaning;
  leaning.inclination = Inclination{0.01, 0};
  input.captures[input.frames[0].image] = leaning;
  const LocateResult found = locate_from_detections(input);
  ASSERT_TRUE(found.rows[0].fix);
  // The yaw is 0 and the lamps are 1.6 m above: a roll displaces the fix by 1.6 m sin(roll).
  const Eigen::Vector3d moved_m = found.rows[0].fix->pose.position_m - level_m;
  EXPECT_NEAR(moved_m.y(), 1.6 * 0.01, 0.002);
  EXPECT_NEAR(moved_m.x(), 0, 0.002);
  const std::size_t images = input.frames.size();
  EXPECT_THAT(found.warnings, testing::Contains(HasSubstr(std::to_string(images - 1) + " of " +
                                                          std::to_string(images) +
                                                          " images are not in captures.csv")));
}

TEST(LocateFromDetections, ReturnsUndeterminedIfNoFrameHasFix) {
  LocateInput input = example();
  for (Frame& frame : input.frames) frame.detections.resize(1);
  const LocateResult found = locate_from_detections(input);
  EXPECT_EQ(found.failure, StepFailure::undetermined);
  EXPECT_THAT(found.message, HasSubstr("no frame has a fix; the first: "));
}

/// The rig of the positioning's tests, driving along a line with a capture every 0.1 s.
LocateInput drive(double speed_m_per_s) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  LocateInput input{{}, rig.map, rig.calibration};
  for (int i = 0; i < 5; ++i) {
    const double time_s = 0.1 * i;
    rig.body = {{{speed_m_per_s * (time_s - 0.2), 0, 0}, 0.3}, {}};
    rig.body.motion.velocity_m_per_s = Eigen::Rotation2Dd(-0.3) * Eigen::Vector2d(speed_m_per_s, 0);
    const std::string image(1, static_cast<char>('a' + i));
    input.frames.push_back({image, seen_from(rig, 0.05)});
    input.captures[image].time_s = 10 + time_s;
  }
  return input;
}

double worst_error_m(const LocateInput& input, double speed_m_per_s) {
  const LocateResult found = locate_from_detections(input);
  double worst_m = 0;
  for (std::size_t i = 0; i < found.rows.size(); ++i) {
    if (!found.rows[i].fix) return 1;
    const Eigen::Vector3d truth_m(speed_m_per_s * (0.1 * static_cast<double>(i) - 0.2), 0, 0);
    worst_m = std::max(worst_m, (found.rows[i].fix->pose.position_m - truth_m).norm());
  }
  return worst_m;
}

TEST(LocateFromDetections, EstimatesTrueVelocityWithMotionPrior) {
  LocateInput input = drive(1);
  EXPECT_GT(worst_error_m(input, 1), 4e-3);
  input.motion = KnownMotion::make_motion_prior_from_limits(200, 200);  // of no weight
  EXPECT_LT(worst_error_m(input, 1), 1e-6);
  const LocateResult found = locate_from_detections(input);
  EXPECT_NEAR(found.rows[1].fix->velocity_m_per_s->x(), 1, 1e-4);
  EXPECT_NEAR(found.rows[1].fix->velocity_m_per_s->y(), 0, 1e-4);
  EXPECT_EQ(found.rows[1].time_s, 10.1);
  EXPECT_FALSE(found.rows[1].fix->inclination);
  EXPECT_TRUE(found.rows[1].fix->sd);
  EXPECT_FALSE(found.rows[1].fix->noise_sd) << "nothing is known of common errors";
}

TEST(LocateFromDetections, LocatesMovingCameraExactlyWithOdometry) {
  LocateInput input = drive(1);
  for (auto& [image, capture] : input.captures) {
    capture.velocity_m_per_s = Eigen::Rotation2Dd(-0.3) * Eigen::Vector2d(1, 0);
  }
  EXPECT_LT(worst_error_m(input, 1), 1e-9);
  EXPECT_NEAR(locate_from_detections(input).rows[0].fix->velocity_m_per_s->x(), 1, 1e-9);
}

TEST(LocateFromDetections, WindowOfTwoUsesLatestEarlierFrameWithTime) {
  LocateInput input = drive(1);
  for (Frame& frame : input.frames) frame.detections.resize(2);
  input.motion = KnownMotion::make_motion_prior_from_limits(2, 0);
  input.window_size = 2;
  Sensors sensors;
  sensors.motion = input.motion;
  const Positioner positioner(input.lamps, input.calibration);
  for (const auto& [earlier, before_s] : {std::pair(1U, 0.1), {0U, 0.2}}) {
    const LocateResult found = locate_from_detections(input);
    ASSERT_TRUE(found.rows[2].fix);
    const Fix fix = positioner.compute_position_fix(
        input.frames[2].detections, sensors,
        std::array{EarlierFrame{input.frames[earlier].detections, before_s}});
    ASSERT_TRUE(fix.has_succeeded());
    EXPECT_LT((found.rows[2].fix->pose.position_m - fix.state.pose.position_m).norm(), 1e-9);
    input.captures[input.frames[1].image].time_s.reset();
  }
}

TEST(LocateFromDetections, ThrowsForMotionWithoutRowTime) {
  LocateInput input = drive(1);
  input.motion = KnownMotion::make_motion_prior_from_limits(2, 0);
  input.calibration.camera.row_time_s.reset();
  EXPECT_THROW(locate_from_detections(input), std::invalid_argument);
  input.motion.reset();
  EXPECT_NO_THROW(locate_from_detections(input));
  input.captures["a"].velocity_m_per_s = Eigen::Vector2d(1, 0);
  EXPECT_THROW(locate_from_detections(input), std::invalid_argument);
}

TEST(LocateFromDetections, EstimatesTrueTiltWithoutInclinationSensor) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  rig.body.motion.inclination = {0.1, -0.08};
  LocateInput input{{{"a", seen_from(rig, 0.05)}}, rig.map, rig.calibration};
  input.roll_pitch_sd_rad = 1.6;
  const LocateResult found = locate_from_detections(input);
  ASSERT_TRUE(found.rows[0].fix);
  EXPECT_LT(found.rows[0].fix->pose.position_m.norm(), 1e-5);
  EXPECT_NEAR(found.rows[0].fix->inclination->roll_rad, 0.1, 1e-5);
  EXPECT_NEAR(found.rows[0].fix->inclination->pitch_rad, -0.08, 1e-5);
}

}  // namespace
}  // namespace vlp
