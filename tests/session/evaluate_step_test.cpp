// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/evaluate_step.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

TEST(EvaluateFixesAgainstTruth, IsUndeterminedOnlyIfNoCaptureHasFix) {
  FixRow fix{"a.png", "ok", FixRow::Fix{{{1.003, 2.004, 0}, 0}, {}, 0.1}, 4};
  FixRow missing{"b.png", "too_few_lamps", {}, 1};
  EvaluationInput input;
  input.fixes = {"fixes.csv", {fix, missing}};
  const auto make_truth = [](const char* image) { return TruthRow{image, {1, 2}, {}, {}}; };
  input.truth = FileRows<TruthRow>{"truth.csv", {make_truth("a.png"), make_truth("b.png")}};
  const EvaluateResult one = evaluate_fixes_against_truth(input, {});
  ASSERT_TRUE(one.has_succeeded()) << one.message;
  EXPECT_EQ(one.evaluation.fixes, 1U);
  fix.fix.reset();
  fix.status = "degenerate";
  input.fixes.rows = {fix, missing, missing};
  input.fixes.rows[2].image = "c.png";
  input.truth->rows.push_back(make_truth("c.png"));
  const EvaluateResult none = evaluate_fixes_against_truth(input, {});
  EXPECT_EQ(none.failure, StepFailure::undetermined);
  EXPECT_THAT(none.message, testing::HasSubstr("none of 3 captures has a fix (2 of them: "
                                               "too_few_lamps)"));
}

}  // namespace
}  // namespace vlp
