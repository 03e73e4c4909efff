// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/proposed_gates.h"

#include <gmock/gmock.h>

#include <random>

#include "evaluation/evaluation.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// A fix at each of `count` places 1 m apart, with independent errors: 1 mm per horizontal axis,
/// `height_scale` times 2 mm in height, 0.1 degrees in yaw.
EvaluationInput draw_run(std::size_t count, unsigned seed, double height_scale = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  EvaluationInput input;
  input.truth = FileRows<TruthRow>{"truth.csv", {}};
  for (std::size_t i = 0; i < count; ++i) {
    const std::string image = std::to_string(i);
    const double x_m = static_cast<double>(i);
    const double error_x_m = 1e-3 * normal(random), error_y_m = 1e-3 * normal(random);
    const double height_m = height_scale * 2e-3 * normal(random);
    const double yaw_rad = 1.745e-3 * normal(random);
    input.fixes.rows.push_back(
        {image, "ok", FixRow::Fix{{{x_m + error_x_m, error_y_m, height_m}, yaw_rad}, {}, 0}, 3});
    input.truth->rows.push_back({image, {x_m, 0}, 0, 0});
  }
  return input;
}

TEST(ProposeGates, OtherRunOfSameAccuracyPassesProposedGates) {
  int exceeded = 0, checked = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const EvaluationInput first = draw_run(40, 2 * seed), second = draw_run(40, 2 * seed + 1);
    const auto gates = propose_gates(first, evaluate_fixes(first));
    ASSERT_EQ(gates.size(), 5);
    for (const auto& gate : check_gates(gates, collect_metrics(evaluate_fixes(second)))) {
      if (gate.name == "missing_fraction") continue;
      ++checked;
      if (!gate.has_passed_gate()) ++exceeded;
    }
  }
  ASSERT_EQ(checked, 800);
  // Expected: 0.1 % of 800; 0.4 % with standard errors estimated from 40 clusters.
  EXPECT_LE(exceeded, 5);
}

TEST(ProposeGates, RunWithTripledHeightErrorsFailsProposedGates) {
  const EvaluationInput good = draw_run(40, 1), wrong = draw_run(40, 2, 3);
  const auto gates = propose_gates(good, evaluate_fixes(good));
  ASSERT_FALSE(gates.empty());
  EXPECT_THAT(describe_failed_gates(check_gates(gates, collect_metrics(evaluate_fixes(wrong)))),
              HasSubstr("height_rms_mm is"));
}

TEST(ProposeGates, ProposesLimitsSlightlyAboveErrorsWithoutScatter) {
  EvaluationInput input = draw_run(8, 1);
  for (std::size_t i = 0; i < 8; ++i) {
    input.fixes.rows[i].fix->pose = {{static_cast<double>(i) + 1e-3, 0, 0}, 0};
  }
  const auto gates = propose_gates(input, evaluate_fixes(input));
  ASSERT_EQ(gates.size(), 4) << "p90 needs 20 units";
  EXPECT_EQ(gates[0].metric, "mean_mm");
  EXPECT_NEAR(gates[0].limit, 1.01, 1e-9);
  EXPECT_EQ(gates[1].metric, "height_rms_mm");
  EXPECT_NEAR(gates[1].limit, 0.001, 1e-9);
  EXPECT_EQ(gates[3].metric, "missing_fraction");
  EXPECT_EQ(gates[3].limit, 0);
}

TEST(ProposeGates, ReturnsNoGatesForFewerThanFivePositions) {
  const EvaluationInput input = draw_run(4, 1);
  EXPECT_TRUE(propose_gates(input, evaluate_fixes(input)).empty());
}

TEST(ProposeGates, RunPassesItsOwnGatesDespiteMissingFixes) {
  EvaluationInput input = draw_run(21, 1);
  for (std::size_t i = 0; i < 7; ++i) input.fixes.rows[3 * i].fix.reset();
  const Evaluation evaluation = evaluate_fixes(input);
  ASSERT_NEAR(evaluation.missing_fix_fraction(), 1.0 / 3, 1e-12);
  const TemporaryFolder folder;
  const auto gates = read_gates(
      folder.file("gates.yaml", format_gates(propose_gates(input, evaluation), evaluation)),
      list_metric_kinds({MetricSource::evaluation}));
  ASSERT_FALSE(gates.empty());
  EXPECT_EQ(describe_failed_gates(check_gates(gates, collect_metrics(evaluation))), "");
}

TEST(FormatGates, ReadGatesReturnsFormattedGates) {
  const EvaluationInput input = draw_run(40, 1);
  const Evaluation evaluation = evaluate_fixes(input);
  const auto gates = propose_gates(input, evaluation);
  const TemporaryFolder folder;
  const auto read = read_gates(folder.file("gates.yaml", format_gates(gates, evaluation)),
                               list_metric_kinds({MetricSource::evaluation}));
  ASSERT_EQ(gates.size(), 5);
  ASSERT_EQ(read.size(), gates.size());
  for (std::size_t i = 0; i < gates.size(); ++i) {
    EXPECT_EQ(read[i].metric, gates[i].metric);
    EXPECT_NEAR(read[i].limit, gates[i].limit, 1e-5 * gates[i].limit);
  }
}

}  // namespace
}  // namespace vlp
