// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "calibration/adjustment/survey.h"
#include "session/adjust_step.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

TEST(ReplaceDuplicateSetNamesByPaths, UsesPathsForEqualNames) {
  std::vector<AdjustSet> sets{{"check", {}, {}}, {"rotation", {}, {}}, {"check", {}, {}}};
  replace_duplicate_set_names_by_paths(sets, {"a/check", "a/rotation", "b/check"});
  EXPECT_EQ(sets[0].name, "a/check");
  EXPECT_EQ(sets[1].name, "rotation");
  EXPECT_EQ(sets[2].name, "b/check");
  EXPECT_THAT(rejection_message<std::invalid_argument>([&] {
                replace_duplicate_set_names_by_paths(sets, {"a/check", "a/rotation", "a/check"});
              }),
              testing::StartsWith("a/check is named twice"));
}

/// Two rotations in place, each a set whose captures name the pivot "1".
class RunJointAdjustmentStep : public testing::Test {
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

TEST_F(RunJointAdjustmentStep, PivotsOfSetsAreDifferent) {
  const AdjustStepResult result = run_joint_adjustment_step(make_input("1"), {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  const auto metric_mm = find_metric_value(result.metrics, "lever_arm_mm");
  ASSERT_TRUE(metric_mm);
  constexpr double mm_per_m = 1000;
  EXPECT_NEAR(*metric_mm, mm_per_m * lever_arm_m.norm(), 0.01);
}

TEST_F(RunJointAdjustmentStep, HasNoLeverArmWithoutPivots) {
  const AdjustStepResult result = run_joint_adjustment_step(make_input(""), {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_TRUE(find_metric_value(result.metrics, "tilt_deg"));
  EXPECT_FALSE(find_metric_value(result.metrics, "lever_arm_mm"));
}

TEST_F(RunJointAdjustmentStep, CountsPositionsWithoutSd) {
  AdjustStepInput input = make_input("1");
  for (std::size_t i = 0; i < 3; ++i) {
    Capture& capture = input.sets[1].captures[input.sets[1].frames[i].image];
    capture.x_m = 0.25;
    capture.y_m = -0.1;
  }
  EXPECT_THAT(
      run_joint_adjustment_step(input, {}).warnings,
      testing::Contains(testing::HasSubstr("set 1: the positions of 3 captures are ignored")));
}

}  // namespace
}  // namespace vlp
