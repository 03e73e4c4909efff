// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/evaluate_step.h"

#include <gmock/gmock.h>

#include <cmath>

#include "rig/input_error.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Fixes of `count` captures along x, displaced by `error_m` in alternating directions.
EvaluationInput make_evaluation_input(int count, double error_m) {
  EvaluationInput input;
  input.fixes.file = "folder/fixes.csv";
  input.truth.emplace();
  input.truth->file = "truth.csv";
  for (int i = 0; i < count; ++i) {
    const std::string image = std::to_string(i) + ".png";
    const Eigen::Vector2d place_m(0.05 * i - 0.3, 0.1);
    const double shift_m = i % 2 == 0 ? error_m : -error_m;
    input.truth->rows.push_back({image, place_m, 0, 0});
    input.fixes.rows.push_back(
        {image, "ok", FixRow::Fix{{{place_m.x() + shift_m, place_m.y(), 0}, 0}, {}, 0.1}, 6});
  }
  return input;
}

TEST(EvaluateWithTruth, IsUndeterminedOnlyIfNoCaptureHasFix) {
  FixRow fix{"a.png", "ok", FixRow::Fix{{{1.003, 2.004, 0}, 0}, {}, 0.1}, 4};
  FixRow missing{"b.png", "too_few_lamps", {}, 1};
  EvaluationInput input;
  input.fixes = {"fixes.csv", {fix, missing}};
  const auto make_truth = [](const char* image) { return TruthRow{image, {1, 2}, {}, {}}; };
  input.truth = FileRows<TruthRow>{"truth.csv", {make_truth("a.png"), make_truth("b.png")}};
  const EvaluateResult one = evaluate_with_truth(input, {});
  ASSERT_TRUE(one.has_succeeded()) << one.message;
  EXPECT_EQ(one.evaluation.fixes, 1U);
  fix.fix.reset();
  fix.status = "degenerate";
  input.fixes.rows = {fix, missing, missing};
  input.fixes.rows[2].image = "c.png";
  input.truth->rows.push_back(make_truth("c.png"));
  const EvaluateResult none = evaluate_with_truth(input, {});
  EXPECT_EQ(none.failure, StepFailure::undetermined);
  EXPECT_THAT(none.message, testing::HasSubstr("none of 3 captures has a fix (2 of them: "
                                               "too_few_lamps)"));
}

TEST(EvaluateWithTruth, WarnsIfErrorsAreBelowTheoreticalLimit) {
  EvaluationInput input = make_evaluation_input(12, 1e-4);
  const auto below = HasSubstr("times the theoretical limit: either the stated pixel noise");
  input.crlb_input = EvaluationInput::CrlbInput{synthetic_lamps(), synthetic_camera(), 5};
  const EvaluateResult small = evaluate_with_truth(input, {});
  ASSERT_TRUE(small.has_succeeded()) << small.message;
  EXPECT_THAT(small.warnings, ElementsAre(below));
  input.crlb_input->noise_px = 1e-3;
  EXPECT_THAT(evaluate_with_truth(input, {}).warnings, IsEmpty());
}

TEST(EvaluateWithTruth, WarnsIfTruthDoesNotDetermineTheoreticalLimit) {
  EvaluationInput input = make_evaluation_input(12, 1e-3);
  const auto missing = HasSubstr("no theoretical limit: the ground truth has no z_m and yaw_rad");
  EXPECT_THAT(evaluate_with_truth(input, {}).warnings, IsEmpty()) << "was not asked";
  input.crlb_input = EvaluationInput::CrlbInput{synthetic_lamps(), synthetic_camera(), 0.1};
  EXPECT_THAT(evaluate_with_truth(input, {}).warnings, Not(Contains(missing)));
  for (TruthRow& row : input.truth->rows) row.yaw_rad.reset();
  EXPECT_THAT(evaluate_with_truth(input, {}).warnings, ElementsAre(missing));
}

TEST(EvaluateWithTruth, WarnsIfFixesDetermineNoLine) {
  EvaluationInput input = make_evaluation_input(12, 0);
  input.truth.reset();
  input.line_m = CommandedLine{Eigen::Vector2d(-0.3, 0.1), Eigen::Vector2d(0.3, 0.1)};
  const auto no_line = HasSubstr("no line is fitted: the fixes do not determine a direction");
  EXPECT_THAT(evaluate_with_truth(input, {}).warnings, Not(Contains(no_line)));
  for (FixRow& row : input.fixes.rows) row.fix->pose.position_m.setZero();
  EXPECT_THAT(evaluate_with_truth(input, {}).warnings, Contains(no_line));
}

TEST(EvaluateWithTruth, WarnsOfMissingFixesThatNoGateLimits) {
  EvaluationInput input = make_evaluation_input(4, 1e-3);
  input.fixes.rows[2].fix.reset();
  input.fixes.rows[2].status = "too_few_lamps";
  const std::string caution = "1 of 4 captures has no fix, and there is no gate 'missing_fraction'";
  const EvaluateResult result = evaluate_with_truth(input, {{"mean_mm", 2}});
  EXPECT_EQ(result.caution, caution);
  EXPECT_THAT(result.warnings, ElementsAre(caution));
  ASSERT_EQ(result.gates.size(), 1U);
  ASSERT_TRUE(result.gates[0].value);
  EXPECT_NEAR(*result.gates[0].value, 1, 1e-9);
  EXPECT_TRUE(result.gates[0].has_passed_gate());
  EXPECT_THAT(result.notes, Contains(HasSubstr("too few captures with a fix for intervals")));
  const std::vector<Gate> limited{{"mean_mm", 2}, {"missing_fraction", 0.5}};
  EXPECT_THAT(evaluate_with_truth(input, limited).warnings, IsEmpty());
}

TEST(ComputeSamePositionRadius, IsMillimeterPlusTwiceLengthOfLeverArm) {
  Calibration calibration{synthetic_camera(), {}, {}, {}, {}};
  EXPECT_DOUBLE_EQ(compute_same_position_radius_m(calibration), 0.001);
  calibration.rotation_center = tilted_by(calibration.camera, 0.02, 1);
  EXPECT_DOUBLE_EQ(compute_same_position_radius_m(calibration), 0.001);
  calibration.rotation_center->lever_arm_m = Eigen::Vector2d(0.03, -0.04);
  EXPECT_DOUBLE_EQ(compute_same_position_radius_m(calibration), 0.101);
}

class RenderEvaluationHtml : public testing::Test {
 protected:
  std::string render() const {
    return render_evaluation_html({input, result, synthetic_lamps(), drives, page});
  }
  std::string find_title() const {
    const std::string html = render();
    const auto begin = html.find("<title>") + 7;
    return html.substr(begin, html.find("</title>") - begin);
  }
  const EvaluationInput input = make_evaluation_input(12, 1e-3);
  EvaluateResult result = evaluate_with_truth(input, {});
  std::vector<Drive> drives;
  Report page;
};

TEST_F(RenderEvaluationHtml, TitleIsNameOfCameraElseOfFixes) {
  EXPECT_EQ(find_title(), "Accuracy report: fixes.csv");
  page.calibration = Calibration{synthetic_camera(), {}, {}, {}, {}};
  page.calibration->camera.id = "";
  EXPECT_EQ(find_title(), "Accuracy report: fixes.csv");
  page.calibration->camera.id = "unit-7";
  EXPECT_EQ(find_title(), "Accuracy report: unit-7");
}

TEST_F(RenderEvaluationHtml, ContainsPlotAndStatisticsOfEachDrive) {
  drives.push_back({input.fixes, {Eigen::Vector2d(-0.3, 0.1), Eigen::Vector2d(0.3, 0.1)}});
  drives.back().fixes.file = "folder/line-y-fixes.csv";
  const std::string html = render();
  for (const char* text : {"line-y-fixes.csv: fitted line from the commanded one, mean",
                           "line-y-fixes.csv. Commanded line, fixes and the line fitted"}) {
    EXPECT_NE(html.find(text), std::string::npos) << text;
  }
  for (FixRow& row : drives.back().fixes.rows) row.fix->pose.position_m.setZero();
  EXPECT_THAT([&] { render(); },
              testing::ThrowsMessage<InputError>(HasSubstr("no line can be fitted to its fixes")));
}

}  // namespace
}  // namespace vlp
