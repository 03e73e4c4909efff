// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/rotation_step.h"

#include <gmock/gmock.h>

#include <numbers>

#include "calibration/adjustment/survey.h"
#include "rig/calibration_error.h"
#include "support/body_rig.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const auto kNoiseWarning = HasSubstr("px of noise, ");

/// Camera of a Survey that rotates about an axis, with a lever arm.
struct RotatingCamera {
  Survey survey{1e-9};
  LampCaptures captures{{}, survey.truth.map, "lamps.yaml", survey.input.calibration};

  void rotate(double height_m, int count) {
    survey.turn({0.1, -0.05, height_m}, count);
    captures.frames.clear();
    for (const AdjustmentCapture& capture : survey.input.captures) {
      captures.frames.push_back({capture.name, capture.detections});
    }
  }
  void add_noise(Random& random) {
    for (Frame& frame : captures.frames) {
      frame.detections = with_noise(std::move(frame.detections), random);
    }
  }
  void state_noise(double sigma_px) {
    for (Frame& frame : captures.frames) {
      for (Detection& detection : frame.detections) detection.sigma_px = sigma_px;
    }
  }
  RotationResult calibrate(RotationMethod method = RotationMethod::axis) const {
    return run_rotation_step(captures, method, {"", "test", "1.2", "--quick", {}});
  }
  TiltResult calibrate_tilt(bool refine_map = false) const {
    return run_tilt_step(captures, refine_map, {});
  }
};

double find_metric_or_minus_one(const StepResult& result, const std::string& metric) {
  return find_metric_value(result.metrics, metric).value_or(-1);
}

TEST(RunRotationStep, MetricsAreTiltLeverArmAndResidualsOfExactCaptures) {
  RotatingCamera camera;
  for (const double height_m : {0.0, 0.4}) camera.rotate(height_m, 8);
  const RotationResult result = camera.calibrate();
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, IsEmpty());
  EXPECT_NEAR(find_metric_or_minus_one(result, "tilt_deg"), 0.02 * 180 / std::numbers::pi, 1e-6);
  EXPECT_NEAR(find_metric_or_minus_one(result, "lever_arm_mm"), std::hypot(9, 4), 1e-5);
  EXPECT_NEAR(find_metric_or_minus_one(result, "rotation_px"), 0, 1e-6);
  const auto& center = result.calibration.rotation_center;
  const auto covariance = compute_center_covariance(result.calibration);
  ASSERT_TRUE(center && covariance);
  EXPECT_NEAR(find_metric_or_minus_one(result, "rotation_sd_px"), std::sqrt(covariance->trace()),
              1e-12);
  EXPECT_GE(find_metric_or_minus_one(result, "rotation_spread_px"), 0);
  ASSERT_EQ(result.calibration.history.size(), 1U);
  EXPECT_EQ(result.calibration.history[0].part, "rotation_center");
  EXPECT_EQ(result.calibration.history[0].options, "--quick");
  EXPECT_TRUE(result.drawing);
}

TEST(RunRotationStep, WarnsIfResidualsExceedThreeTimesStatedNoise) {
  RotatingCamera camera;
  for (const double height_m : {0.0, 0.4}) camera.rotate(height_m, 8);
  Random random(4);
  camera.add_noise(random);
  const double residual_px = find_metric_or_minus_one(camera.calibrate(), "rotation_px");
  ASSERT_GT(residual_px, 0.01);
  camera.state_noise(residual_px / 2.8);
  EXPECT_THAT(camera.calibrate().warnings, Not(Contains(kNoiseWarning)));
  camera.state_noise(residual_px / 3.3);
  EXPECT_THAT(camera.calibrate().warnings, Contains(kNoiseWarning));
  for (Frame& frame : camera.captures.frames) frame.detections[0].sigma_px.reset();
  EXPECT_THAT(camera.calibrate().warnings, Not(Contains(kNoiseWarning))) << "noise is unknown";
}

TEST(RunRotationStep, WarnsThatLeverArmIsNotEstimatedFromOneHeight) {
  RotatingCamera camera;
  camera.survey.lever_arm_m.setZero();
  for (Lamp& lamp : camera.survey.truth.map.lamps) lamp.position_m.z() = 1.6;
  camera.captures.lamps = camera.survey.truth.map;
  camera.rotate(0.25, 8);
  const RotationResult axis = camera.calibrate();
  ASSERT_TRUE(axis.has_succeeded()) << axis.message;
  EXPECT_THAT(axis.warnings,
              ElementsAre(HasSubstr("fixes at z = 0.250 m will be those of the rotation axis: add "
                                    "captures at a second height")));
  EXPECT_FALSE(find_metric_value(axis.metrics, "lever_arm_mm"));
  camera.rotate(0.6, 8);
  EXPECT_THAT(camera.calibrate().warnings, IsEmpty());
  const RotationResult circle = camera.calibrate(RotationMethod::circle);
  ASSERT_TRUE(circle.has_succeeded()) << circle.message;
  EXPECT_THAT(circle.warnings,
              Contains(HasSubstr("this method assumes a lever arm of zero, and the center is a "
                                 "mean over 2 heights: use --method axis")));
}

TEST(RunRotationStep, WarnsIfThreeCapturesLeaveNoStandardDeviation) {
  const auto warning = HasSubstr("center has no standard deviation: add captures, four or more");
  for (const int count : {3, 4}) {
    RotatingCamera camera;
    camera.rotate(0, count);
    for (Frame& frame : camera.captures.frames) {
      for (Detection& detection : frame.detections) detection.sigma_px.reset();
    }
    const RotationResult result = camera.calibrate(RotationMethod::circle);
    ASSERT_TRUE(result.has_succeeded()) << result.message;
    EXPECT_EQ(result.calibration.covariance.has_value(), count == 4);
    EXPECT_EQ(find_metric_value(result.metrics, "rotation_sd_px").has_value(), count == 4);
    if (count == 4) {
      EXPECT_THAT(result.warnings, Not(Contains(warning)));
    } else {
      EXPECT_THAT(result.warnings, Contains(warning));
    }
  }
}

TEST(RunRotationStep, FailsIfCapturesAreNoRotationInPlace) {
  RotatingCamera camera;
  for (int i = 0; i < 8; ++i) camera.survey.stand({{0.1 * i - 0.4, 0.05 * (i % 3), 0}, 0.7 * i});
  camera.rotate(0, 1);
  const RotationResult result = camera.calibrate();
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_TRUE(result.file_to_correct.empty());
  EXPECT_FALSE(result.calibration.rotation_center);
}

TEST(RunRotationStep, SmallArcFailsWithMovedLampOnlyAsWarning) {
  RotatingCamera camera;
  camera.survey.truth.map.lamps[1].position_m.x() += 0.03;
  camera.rotate(0, 36);
  camera.captures.frames.resize(8);  // 70 degrees
  const RotationResult result = camera.calibrate();
  EXPECT_EQ(result.failure, StepFailure::undetermined) << result.message;
  EXPECT_THAT(result.message, Not(HasSubstr("lamp 2")));
  EXPECT_THAT(result.warnings, Contains(HasSubstr("lamp 2 hangs 30 mm from where the map")));
}

TEST(RunRotationStep, FailsWithWrongMapForMapOfAnotherRoom) {
  RotatingCamera camera;
  for (const double height_m : {0.0, 0.4}) camera.rotate(height_m, 8);
  std::vector<Lamp>& lamps = camera.captures.lamps.lamps;
  Random random(2);
  for (Lamp& lamp : lamps) {
    lamp.position_m = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1.4, 2)};
  }
  const RotationResult result = camera.calibrate();
  EXPECT_EQ(result.failure, StepFailure::wrong_map) << result.message;
  EXPECT_EQ(result.file_to_correct, "lamps.yaml");
}

TEST(RunRotationStep, WarnsOfRejectedCaptures) {
  RotatingCamera camera;
  for (const double height_m : {0.0, 0.4}) camera.rotate(height_m, 8);
  camera.captures.frames.push_back({"one lamp", camera.captures.frames[0].detections});
  camera.captures.frames.back().detections.resize(1);
  const RotationResult result = camera.calibrate();
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, ElementsAre(testing::StartsWith("one lamp: rejected: ")));
}

TEST(RunTiltStep, WarnsIfResidualsExceedThreeTimesStatedNoise) {
  RotatingCamera camera;
  for (int i = 0; i < 12; ++i) camera.survey.stand({{0.05 * i - 0.3, 0.04 * (i % 3), 0}, 0.7 * i});
  camera.rotate(0, 1);
  Random random(4);
  camera.add_noise(random);
  const auto warning = HasSubstr("times those expected from sigma_px: lamp map or lens");
  camera.state_noise(0.001);
  const double scale = camera.calibrate_tilt().tilt.noise_scale;
  ASSERT_GT(scale, 10);
  camera.state_noise(0.001 * scale / 2.8);
  EXPECT_THAT(camera.calibrate_tilt().warnings, Not(Contains(warning)));
  camera.state_noise(0.001 * scale / 3.3);
  const TiltResult noisy = camera.calibrate_tilt();
  ASSERT_TRUE(noisy.has_succeeded()) << noisy.message;
  EXPECT_THAT(noisy.warnings, ElementsAre(HasSubstr("the residuals are 3.3 times those expected")));
  EXPECT_THAT(noisy.warnings, ElementsAre(HasSubstr("; --refine-map may help")));
  EXPECT_NEAR(find_metric_or_minus_one(noisy, "tilt_deg"), 0.02 * 180 / std::numbers::pi, 0.02);
  const TiltResult refined = camera.calibrate_tilt(true);
  ASSERT_TRUE(refined.has_succeeded()) << refined.message;
  EXPECT_THAT(refined.warnings, Not(Contains(HasSubstr("--refine-map"))));
}

TEST(RunTiltStep, RequiresRowTimeOnlyForMovingCamera) {
  RotatingCamera camera;
  for (int i = 0; i < 12; ++i) camera.survey.stand({{0.05 * i - 0.3, 0.04 * (i % 3), 0}, 0.7 * i});
  camera.rotate(0, 1);
  camera.captures.motions.assign(camera.captures.frames.size(), KnownMotion());
  EXPECT_TRUE(camera.calibrate_tilt().has_succeeded());
  camera.captures.motions[3].velocity_m_per_s = Eigen::Vector2d(1, 0);
  EXPECT_THROW(camera.calibrate_tilt(), std::invalid_argument);
}

TEST(RunTiltStep, FindsMovedLampOnlyFromCapturesAtRest) {
  RotatingCamera camera;
  camera.survey.truth.map.lamps[1].position_m.x() += 0.03;
  for (int i = 0; i < 40; ++i) {
    camera.survey.stand({{0.05 * (i % 10) - 0.2, 0.05 * (i % 4), 0}, 0.7 * i});
  }
  camera.rotate(0, 1);
  camera.captures.calibration.camera.row_time_s = 1e-9;
  camera.captures.calibration.camera.readout = Readout::rows;
  const auto lamp = HasSubstr("lamp 2 hangs 30 mm from where the map has it");
  EXPECT_THAT(camera.calibrate_tilt().warnings, Contains(lamp)) << "no motion is stated";
  KnownMotion moving;
  moving.velocity_m_per_s = {1, 0};
  auto& motions = camera.captures.motions;
  motions.assign(camera.captures.frames.size(), KnownMotion());
  motions.back() = moving;
  EXPECT_THAT(camera.calibrate_tilt().warnings, Contains(lamp)) << "one of the captures moves";
  motions.assign(camera.captures.frames.size(), moving);
  EXPECT_THAT(camera.calibrate_tilt().warnings, Not(Contains(lamp)));
  for (Lamp& mirrored : camera.captures.lamps.lamps) mirrored.position_m.y() *= -1;
  const TiltResult result = camera.calibrate_tilt();
  EXPECT_EQ(result.failure, StepFailure::wrong_map) << "an error of the map as a whole";
}

TEST(RunTiltStep, ReturnsUndeterminedForCapturesOfSingleLamp) {
  RotatingCamera camera;
  camera.rotate(0, 8);
  for (Frame& frame : camera.captures.frames) frame.detections.resize(1);
  const TiltResult result = camera.calibrate_tilt();
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_FALSE(result.message.empty());
  EXPECT_FALSE(result.calibration.rotation_center);
}

}  // namespace
}  // namespace vlp
