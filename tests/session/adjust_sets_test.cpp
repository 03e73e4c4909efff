// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "calibration/adjustment/survey.h"
#include "rig/input_error.h"
#include "session/adjust_step.h"
#include "support/body_rig.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(MakeSetNamesUnique, UsesPathsForEqualNames) {
  std::vector<AdjustSet> sets{{"check", {}, {}}, {"rotation", {}, {}}, {"check", {}, {}}};
  make_set_names_unique(sets, {"a/check", "a/rotation", "b/check"});
  EXPECT_EQ(sets[0].name, "a/check");
  EXPECT_EQ(sets[1].name, "rotation");
  EXPECT_EQ(sets[2].name, "b/check");
  EXPECT_THAT(rejection_message<std::invalid_argument>([&] {
                make_set_names_unique(sets, {"a/check", "a/rotation", "a/check"});
              }),
              testing::StartsWith("a/check is named twice"));
}

/// Two rotations in place, each a set whose captures name the pivot "1".
class RunAdjustStep : public testing::Test {
 protected:
  AdjustStepInput make_input(const char* pivot) {
    Survey survey;
    AdjustStepInput input{
        {}, survey.truth.map, "lamps.yaml", survey.input.calibration, "camera.yaml", 0.002, {}};
    for (const Eigen::Vector3d& axis_m : {Eigen::Vector3d(-0.2, 0.1, 0), {0.25, -0.1, 0}}) {
      const std::size_t first = survey.input.captures.size();
      survey.turn(axis_m, 12);
      AdjustSet set{"set " + std::to_string(input.sets.size()), {}, {}};
      for (std::size_t i = first; i < survey.input.captures.size(); ++i) {
        const AdjustmentCapture& capture = survey.input.captures[i];
        set.frames.push_back({capture.name, capture.detections});
        set.captures[capture.name].pivot = pivot;
      }
      input.sets.push_back(set);
    }
    lever_arm_m = survey.lever_arm_m;
    return input;
  }
  Eigen::Vector2d lever_arm_m;
};

TEST_F(RunAdjustStep, PivotsOfSetsAreDifferent) {
  const AdjustStepResult result = run_adjust_step(make_input("1"), {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  const auto metric_mm = find_metric_value(result.metrics, "lever_arm_mm");
  ASSERT_TRUE(metric_mm);
  constexpr double mm_per_m = 1000;
  EXPECT_NEAR(*metric_mm, mm_per_m * lever_arm_m.norm(), 0.01);
}

TEST_F(RunAdjustStep, HasNoLeverArmWithoutPivots) {
  const AdjustStepResult result = run_adjust_step(make_input(""), {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_TRUE(find_metric_value(result.metrics, "tilt_deg"));
  EXPECT_FALSE(find_metric_value(result.metrics, "lever_arm_mm"));
}

TEST_F(RunAdjustStep, CapturesOfInPlaceRotationShareOnePivot) {
  AdjustStepInput input = make_input("");
  for (AdjustSet& set : input.sets) set.is_in_place_rotation = true;
  const AdjustStepResult result = run_adjust_step(input, {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, IsEmpty());
  const auto metric_mm = find_metric_value(result.metrics, "lever_arm_mm");
  ASSERT_TRUE(metric_mm);
  EXPECT_NEAR(*metric_mm, 1e3 * lever_arm_m.norm(), 0.01);
}

/// Sets the known positions of all captures of set 1; that of the first has an error of `error_m`
/// in x.
AdjustStepInput set_known_positions(AdjustStepInput input, MeasuredPoint measured_point,
                                    double error_m) {
  bool is_first = true;
  for (const Frame& frame : input.sets[1].frames) {
    Capture& capture = input.sets[1].captures[frame.image];
    capture.pivot = is_first ? "first" : "others";
    capture.x_m = 0.25 + (is_first ? error_m : 0);
    capture.y_m = -0.1;
    capture.measured_point = measured_point;
    capture.position_sd_m = 1e-4;
    is_first = false;
  }
  return input;
}

TEST_F(RunAdjustStep, WarnsOfPositionThatContradictsCaptures) {
  const AdjustStepInput input = make_input("1");
  EXPECT_THAT(run_adjust_step(set_known_positions(input, MeasuredPoint::axis, 0), {}).warnings,
              IsEmpty());
  const auto axis = run_adjust_step(set_known_positions(input, MeasuredPoint::axis, 0.05), {});
  ASSERT_TRUE(axis.has_succeeded()) << axis.message;
  EXPECT_THAT(axis.warnings,
              Contains("set 1/first: the position has an error of 50.0 mm and is ignored"));
  const auto camera = run_adjust_step(set_known_positions(input, MeasuredPoint::camera, 0.05), {});
  ASSERT_TRUE(camera.has_succeeded()) << camera.message;
  EXPECT_THAT(camera.warnings,
              Contains(HasSubstr("mm and is ignored: is it that of the camera, and not of the "
                                 "rotation axis (reference_point: axis)?")));
}

TEST_F(RunAdjustStep, UsesPositionSdOfTableElseOfOption) {
  AdjustStepInput input = set_known_positions(make_input("1"), MeasuredPoint::axis, 0);
  for (auto& [image, capture] : input.sets[1].captures) capture.position_sd_m.reset();
  EXPECT_THAT(run_adjust_step(input, {}).warnings,
              Contains(HasSubstr("set 1: the positions of 12 captures are ignored")));
  input.position_sd_m = 1e-4;
  const AdjustStepResult result = run_adjust_step(input, {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, IsEmpty());
  ASSERT_FALSE(result.adjustment.known_positions.empty());
  EXPECT_LT(result.adjustment.known_positions[0].residual_m.norm(), 1e-3);
  input.position_sd_m = 0;
  EXPECT_THAT(rejection_message([&] { run_adjust_step(input, {}); }),
              HasSubstr("set 1: position_sd_m is 0"));
}

TEST_F(RunAdjustStep, UsesMapSdOnlyForLampsWithoutSd) {
  AdjustStepInput input = make_input("1");
  input.lamps.lamps[2].sd_m.reset();
  const AdjustStepResult result = run_adjust_step(input, {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  input.map_sd_m.reset();
  EXPECT_THAT(rejection_message([&] { run_adjust_step(input, {}); }),
              HasSubstr("lamps.yaml: lamp 3 has no sd_m"));
}

TEST_F(RunAdjustStep, StoresSetsLampsAndCovarianceOfSelectedMap) {
  AdjustStepInput input = make_input("1");
  input.sets[1].frames.pop_back();
  const AdjustStepResult surveyed = run_adjust_step(input, {"", "test", "1.2", "", {}});
  ASSERT_TRUE(surveyed.has_succeeded() && surveyed.calibration.adjustment) << surveyed.message;
  const Adjustment& kept = *surveyed.calibration.adjustment;
  EXPECT_THAT(kept.sets, testing::ElementsAre("set 0", "set 1"));
  EXPECT_EQ(kept.captures, 23);
  ASSERT_TRUE(surveyed.calibration.covariance);
  const JointCovariance& joint = *surveyed.calibration.covariance;
  const Eigen::Index rows = joint.matrix.rows();
  EXPECT_EQ(joint.matrix, surveyed.adjustment.surveyed_covariance.bottomRightCorner(rows, rows));
  ASSERT_EQ(joint.lamps.size(), input.lamps.lamps.size());
  EXPECT_EQ(joint.lamps[3].id, 4);
  EXPECT_EQ(joint.lamps[3].position_m, input.lamps.lamps[3].position_m);
  ASSERT_FALSE(surveyed.calibration.history.empty());
  EXPECT_EQ(surveyed.calibration.history.back().part, "adjustment");
  input.lamps.lamps[3].position_m.x() += 0.003;
  input.refine_map = true;
  const AdjustStepResult refined = run_adjust_step(input, {});
  ASSERT_TRUE(refined.has_succeeded() && refined.calibration.adjustment) << refined.message;
  ASSERT_TRUE(refined.calibration.covariance);
  EXPECT_EQ(refined.calibration.covariance->matrix,
            refined.adjustment.refined_covariance.bottomRightCorner(rows, rows));
  ASSERT_GT(refined.calibration.covariance->lamps.size(), 3U);
  EXPECT_EQ(refined.calibration.covariance->lamps[3].position_m,
            refined.adjustment.refined_map.lamps[3].position_m);
  EXPECT_THAT(rejection_message([&] {
                input.calibration = surveyed.calibration;
                run_adjust_step(input, {});
              }),
              HasSubstr("camera.yaml: is adjusted already"));
}

TEST_F(RunAdjustStep, WarnsOfResidualsAboveStatedNoise) {
  AdjustStepInput input = make_input("1");
  Random random(3);
  for (AdjustSet& set : input.sets) {
    for (Frame& frame : set.frames) {
      frame.detections = with_noise(std::move(frame.detections), random);
      for (Detection& detection : frame.detections) *detection.sigma_px /= 2;
    }
  }
  const AdjustStepResult result = run_adjust_step(input, {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_NEAR(result.adjustment.noise_scale, 2, 0.2);
  EXPECT_THAT(result.warnings, Contains(HasSubstr("times those expected from sigma_px")));
}

TEST_F(RunAdjustStep, WarnsOfLensThatContradictsCaptures) {
  AdjustStepInput input = make_input("1");
  input.lens_sd_px = 0.05;
  const auto warning = HasSubstr("the captures contradict the lens: its correction has a");
  const AdjustStepResult right = run_adjust_step(input, {});
  ASSERT_TRUE(right.has_succeeded()) << right.message;
  EXPECT_THAT(right.warnings, Not(Contains(warning)));
  ASSERT_TRUE(right.calibration.covariance);
  EXPECT_TRUE(right.calibration.covariance->find_row("fx"));
  ASSERT_TRUE(right.calibration.intrinsics_report);
  EXPECT_TRUE(right.calibration.intrinsics_report->covariance);
  for (AdjustSet& set : input.sets) {
    for (Frame& frame : set.frames) {
      for (Detection& detection : frame.detections) {
        const Eigen::Vector2d center_px = input.calibration.camera.principal_point_px();
        const Eigen::Vector2d from_center_px = detection.pixel - center_px;
        detection.pixel += 4e-8 * from_center_px.squaredNorm() * from_center_px;
      }
    }
  }
  const AdjustStepResult wrong = run_adjust_step(input, {});
  ASSERT_TRUE(wrong.has_succeeded()) << wrong.message;
  EXPECT_THAT(wrong.warnings, Contains(warning));
  EXPECT_THAT(rejection_message([&] {
                input.calibration.intrinsics_report.emplace().covariance =
                    lens_covariance(input.calibration.camera, 0.1, 8);
                run_adjust_step(input, {});
              }),
              HasSubstr("camera.yaml: has a lens covariance already"));
}

/// A camera that drives at 1 m/s and whose velocity is known. The lamps seem displaced by up to
/// 20 mm in its images.
TEST(RunAdjustStepOfDrive, FindsNoMovedLampInExactCapturesOfMovingCamera) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  AdjustStepInput input{{}, rig.map, "lamps.yaml", rig.calibration, "camera.yaml", 0.002, {}};
  AdjustSet set{"drive", {}, {}};
  for (int i = 0; i < 36; ++i) {
    rig.body.pose = {{0.05 * (i % 9) - 0.2, 0.05 * (i % 4), 0}, 0.7 * i};
    rig.body.motion.velocity_m_per_s = {1, 0};
    const std::string image = std::to_string(i);
    set.frames.push_back({image, seen_from(rig, 0.05)});
    set.captures[image].velocity_m_per_s = Eigen::Vector2d(1, 0);
  }
  input.sets.push_back(set);
  const AdjustStepResult result = run_adjust_step(input, {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, IsEmpty());
  EXPECT_NEAR(result.adjustment.residual_px, 0, 1e-3);
}

TEST_F(RunAdjustStep, RequiresRowTimeOnlyForMovingCamera) {
  AdjustStepInput input = make_input("1");
  input.calibration.camera.row_time_s.reset();
  EXPECT_NO_THROW(run_adjust_step(input, {}));
  input.sets[0].captures[input.sets[0].frames[0].image].velocity_m_per_s = Eigen::Vector2d(1, 0);
  EXPECT_THROW(run_adjust_step(input, {}), std::invalid_argument);
}

}  // namespace
}  // namespace vlp
