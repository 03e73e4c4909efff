// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// locate_from_detections(): sensors, stated noise, and warnings about the input.
#include <gmock/gmock.h>

#include <optional>

#include "session/locate_step.h"
#include "support/body_rig.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(MakeSensorReadings, UsesDefaultsForImageThatIsNotInTable) {
  LocateInput input;
  input.motion = KnownMotion::make_motion_prior_from_limits(3, 2);
  input.roll_pitch_sd_rad = 0.2;
  input.inclination_sigma_rad = 0.1;
  const Sensors sensors = make_sensor_readings("a", input);
  EXPECT_FALSE(sensors.inclination || sensors.time_s || sensors.height || sensors.height_and_yaw);
  EXPECT_EQ(sensors.inclination_sigma_rad, 0.2);
  ASSERT_TRUE(sensors.motion);
  EXPECT_EQ(sensors.motion->velocity_sd_m_per_s, input.motion->velocity_sd_m_per_s);
}

TEST(MakeSensorReadings, ReadsTimeMotionAndInclinationOfTable) {
  LocateInput input;
  input.roll_pitch_sd_rad = 0.2;
  input.inclination_sigma_rad = 0.1;
  input.yaw_rate_sd_rad_per_s = 0.03;
  Capture& capture = input.captures["a"];
  capture.time_s = 5;
  EXPECT_EQ(make_sensor_readings("a", input).inclination_sigma_rad, 0.2);
  capture.inclination = Inclination{0.01, 0.02};
  capture.yaw_rate_rad_per_s = 0.5;
  const Sensors sensors = make_sensor_readings("a", input);
  EXPECT_EQ(sensors.time_s, 5);
  ASSERT_TRUE(sensors.inclination && sensors.motion);
  EXPECT_EQ(sensors.inclination->pitch_rad, 0.02);
  EXPECT_EQ(sensors.inclination_sigma_rad, 0.1);
  EXPECT_EQ(sensors.motion->yaw_rate_rad_per_s, 0.5);
  EXPECT_EQ(sensors.motion->yaw_rate_sd_rad_per_s, 0.03);
  input.motion = KnownMotion::make_motion_prior_from_limits(3, 2);
  capture.yaw_rate_rad_per_s.reset();
  capture.velocity_m_per_s = Eigen::Vector2d(0.5, -0.2);
  capture.velocity_sd_m_per_s = 0.05;
  const Sensors moving = make_sensor_readings("a", input);
  ASSERT_TRUE(moving.motion);
  EXPECT_EQ(moving.motion->velocity_m_per_s, Eigen::Vector2d(0.5, -0.2));
  EXPECT_EQ(moving.motion->velocity_sd_m_per_s, 0.05);
  EXPECT_EQ(moving.motion->yaw_rate_sd_rad_per_s, input.motion->yaw_rate_sd_rad_per_s);
}

TEST(MakeSensorReadings, UsesHeightAndYawOnlyIfRequested) {
  LocateInput input;
  Capture& capture = input.captures["a"];
  capture.z_m = 0.5;
  capture.yaw_rad = 1;
  input.yaw_sd_rad = 0.02;
  Sensors sensors = make_sensor_readings("a", input);
  EXPECT_FALSE(sensors.height || sensors.height_and_yaw);
  input.allow_single_lamp = true;
  sensors = make_sensor_readings("a", input);
  EXPECT_FALSE(sensors.height);
  ASSERT_TRUE(sensors.height_and_yaw);
  EXPECT_EQ(sensors.height_and_yaw->z_m, 0.5);
  EXPECT_EQ(sensors.height_and_yaw->yaw_rad, 1);
  input.allow_single_lamp = false;
  input.height_sd_m = 0.01;
  sensors = make_sensor_readings("a", input);
  EXPECT_FALSE(sensors.height_and_yaw);
  ASSERT_TRUE(sensors.height);
  EXPECT_EQ(sensors.height->z_m, 0.5);
  EXPECT_EQ(sensors.height->sd_m, 0.01);
  capture.yaw_rad.reset();
  input.allow_single_lamp = true;
  EXPECT_FALSE(make_sensor_readings("a", input).height_and_yaw) << "no yaw";
}

TEST(MakeSensorReadings, SubtractsHeightOfCameraAboveRobot) {
  LocateInput input;
  input.captures["a"].z_m = 0.5;
  input.height_sd_m = 0.01;
  input.positioner_options.mount = CameraMount{{0.1, 0.2, 0.3}, 0};
  const Sensors sensors = make_sensor_readings("a", input);
  ASSERT_TRUE(sensors.height);
  EXPECT_DOUBLE_EQ(sensors.height->z_m, 0.2);
}

/// Returns captures of a level camera at rest, each at another position and yaw.
LocateInput make_captures_at_rest(int count, double sigma_px) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  LocateInput input{{}, rig.map, rig.calibration};
  for (int i = 0; i < count; ++i) {
    rig.body.pose = {{0.05 * i - 0.3, -0.02 * i, 0}, 0.5 * i};
    input.frames.push_back({std::to_string(i), seen_from(rig, sigma_px)});
  }
  return input;
}

void add_noise(LocateInput& input, double noise_px) {
  Random random(6);
  for (Frame& frame : input.frames) {
    for (Detection& detection : frame.detections) {
      detection.pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
    }
  }
}

double residual_ratio(const LocateResult& result) {
  return find_metric_value(result.metrics, "residual_ratio").value_or(-1);
}

TEST(LocateFromDetections, WarnsIfResidualsExceedThreeTimesStatedNoise) {
  LocateInput input = make_captures_at_rest(12, 0.1);
  add_noise(input, 0.1);
  const double noise_px = 0.1 * residual_ratio(locate_from_detections(input));
  EXPECT_NEAR(noise_px, 0.1, 0.01);
  const auto warning = HasSubstr("px of noise, ");
  input.sigma_px = noise_px / 2.8;
  const LocateResult below = locate_from_detections(input);
  EXPECT_THAT(below.warnings, Not(Contains(warning)));
  EXPECT_NEAR(residual_ratio(below), 2.8, 0.05);
  EXPECT_THAT(below.notes, Contains(HasSubstr("residuals are 2.80 times the stated noise")));
  input.sigma_px = noise_px / 3.2;
  const LocateResult above = locate_from_detections(input);
  EXPECT_THAT(above.warnings,
              Contains(HasSubstr("px are stated: sd follows the residuals; are calibration")));
  EXPECT_THAT(above.notes, IsEmpty());
  ASSERT_TRUE(above.rows.size() == 12 && below.rows.size() == 12);
  ASSERT_TRUE(below.rows[0].fix);
  ASSERT_TRUE(above.rows[0].fix && above.rows[0].fix->sd && below.rows[0].fix->sd);
  EXPECT_NEAR((*above.rows[0].fix->sd)[0] / (*below.rows[0].fix->sd)[0], 1, 0.05)
      << "both follow the residuals";
}

TEST(LocateFromDetections, EstimatesNoiseIfNoneIsStated) {
  LocateInput input = make_captures_at_rest(12, 0.1);
  add_noise(input, 0.1);
  const LocateResult stated = locate_from_detections(input);
  for (Frame& frame : input.frames) {
    for (Detection& detection : frame.detections) detection.sigma_px.reset();
  }
  const LocateResult found = locate_from_detections(input);
  ASSERT_TRUE(found.has_succeeded()) << found.message;
  EXPECT_THAT(found.notes, ElementsAre(HasSubstr("px estimated from the residuals")));
  EXPECT_THAT(found.warnings, IsEmpty());
  EXPECT_FALSE(find_metric_value(found.metrics, "residual_ratio"));
  ASSERT_TRUE(found.rows.size() == 12 && stated.rows.size() == 12);
  ASSERT_TRUE(stated.rows[0].fix);
  ASSERT_TRUE(found.rows[0].fix && found.rows[0].fix->sd && stated.rows[0].fix->sd);
  EXPECT_NEAR((*found.rows[0].fix->sd)[0] / (*stated.rows[0].fix->sd)[0], 1, 0.1);
}

TEST(LocateFromDetections, HasNoSdsIfNoiseIsUnknown) {
  LocateInput input = make_captures_at_rest(6, 0.1);
  for (Frame& frame : input.frames) {
    frame.detections.resize(2);
    for (Detection& detection : frame.detections) detection.sigma_px.reset();
  }
  const LocateResult found = locate_from_detections(input);
  ASSERT_TRUE(found.has_succeeded()) << found.message;
  EXPECT_THAT(found.warnings,
              ElementsAre("sigma_px is neither stated nor determined by residuals: sd columns are "
                          "empty"));
  ASSERT_EQ(found.rows.size(), 6U);
  ASSERT_TRUE(found.rows[0].fix);
  EXPECT_FALSE(found.rows[0].fix->sd);
}

TEST(LocateFromDetections, WarnsOfDetectionsFarOutsideImage) {
  LocateInput input = make_captures_at_rest(6, 0.1);
  EXPECT_THAT(locate_from_detections(input).warnings, IsEmpty());
  input.calibration.camera.imager_px = {400, 300};
  input.frames.resize(1);
  input.frames[0].detections = {{1, {439, 100}, 0.1}, {2, {441, 100}, 0.1}, {3, {100, 331}, 0.1}};
  EXPECT_THAT(locate_from_detections(input).warnings,
              Contains(HasSubstr("2 detections are far outside the 400 x 300 px of the camera")));
}

TEST(LocateFromDetections, NotesThatNoCaptureConnectsAllLamps) {
  LocateInput input = make_captures_at_rest(2, 0.1);
  input.compute_lamp_offsets = true;
  EXPECT_THAT(locate_from_detections(input).notes, IsEmpty());
  for (Frame& frame : input.frames) frame.detections.resize(2);
  EXPECT_THAT(locate_from_detections(input).notes,
              ElementsAre("relative lamp positions are not checked: captures do not tie all lamps "
                          "together"));
  input.frames.resize(1);
  EXPECT_THAT(locate_from_detections(input).notes, IsEmpty()) << "one capture";
}

TEST(LocateFromDetections, WindowIgnoresFramesMoreThanFifthOfSecondEarlier) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  rig.body.motion.velocity_m_per_s = {1, 0};
  LocateInput input{{}, rig.map, rig.calibration};
  for (int i = 0; i < 2; ++i) {
    rig.body.pose = {{0.19 * i, 0, 0}, 0};
    const std::string image = std::to_string(i);
    input.frames.push_back({image, seen_from(rig, 0.05)});
    input.frames.back().detections.resize(2);
    input.captures[image].time_s = 10 + 0.19 * i;
  }
  input.motion = KnownMotion::make_motion_prior_from_limits(2, 0);
  const auto find_position_m = [&]() -> std::optional<Eigen::Vector3d> {
    const LocateResult found = locate_from_detections(input);
    if (found.rows.size() != 2 || !found.rows[1].fix) return std::nullopt;
    return found.rows[1].fix->pose.position_m;
  };
  const auto alone_m = find_position_m();
  ASSERT_TRUE(alone_m);
  input.window_size = 3;
  const auto with_earlier_m = find_position_m();
  ASSERT_TRUE(with_earlier_m);
  EXPECT_GT((*with_earlier_m - *alone_m).norm(), 1e-6);
  input.captures["1"].time_s = 10.21;
  EXPECT_EQ(find_position_m(), alone_m);
}

}  // namespace
}  // namespace vlp
