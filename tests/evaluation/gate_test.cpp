// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/gate.h"

#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "evaluation/evaluation.h"
#include "evaluation/evaluation_files.h"
#include "evaluation/junit.h"
#include "support/random.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// Three fixes of four captures with errors of 1, 2 and 6 mm. Only the first has a known height,
/// with an error of 3 mm.
Evaluation evaluation() {
  EvaluationInput input;
  input.fixes.rows = {{"a", "ok", FixRow::Fix{{{1e-3, 0, 3e-3}, 0}, {}, 0}, 3},
                      {"b", "ok", FixRow::Fix{{{0, -2e-3, 0}, 0}, {}, 0}, 3},
                      {"c", "ok", FixRow::Fix{{{0, 6e-3, 0}, 0}, {}, 0}, 3},
                      {"d", "degenerate", {}, 0}};
  input.truth = FileRows<TruthRow>{
      "truth.csv",
      {{"a", {0, 0}, 0, {}}, {"b", {0, 0}, {}, {}}, {"c", {0, 0}, {}, {}}, {"d", {0, 0}, {}, {}}}};
  return evaluate_fixes(input);
}

TEST(CheckGates, PassesOnlyIfValueDoesNotExceedLimit) {
  const auto results = check_gates({{"mean_mm", 3.001},
                                    {"mean_mm", 2.999},
                                    {"p90_mm", 6.001},
                                    {"missing_fraction", 0.25},
                                    {"missing_fraction", 0.249},
                                    {"height_rms_mm", 2.9}},
                                   collect_metrics(evaluation()));
  std::vector<bool> passed;
  for (const CheckedMetric& result : results) passed.push_back(result.has_passed_gate());
  ASSERT_EQ(passed, (std::vector<bool>{true, false, true, true, false, false}));
  EXPECT_NEAR(results[5].value.value(), 3, 1e-9);
  EXPECT_EQ(results[5].unit, "mm");
  EXPECT_EQ(describe_gate(results[5]), "height_rms_mm is 3 mm, at most 2.9 mm is required");
}

TEST(CheckGates, PassesValueEqualToUpperOrLowerLimit) {
  EXPECT_TRUE(check_gates({{"rms_px", 0.3}}, {{"rms_px", 0.3}})[0].has_passed_gate());
  EXPECT_FALSE(check_gates({{"rms_px", 0.3}}, {{"rms_px", 0.31}})[0].has_passed_gate());
  const auto coverage = check_gates({{"coverage", 0.7}}, {{"coverage", 0.69}});
  EXPECT_FALSE(coverage[0].has_passed_gate());
  EXPECT_EQ(describe_gate(coverage[0]), "coverage is 0.69, at least 0.7 is required");
  EXPECT_EQ(describe_failed_gate(coverage[0]),
            "the board views do not cover the image (" + describe_gate(coverage[0]) + ")");
  EXPECT_TRUE(check_gates({{"coverage", 0.7}}, {{"coverage", 0.7}})[0].has_passed_gate());
}

TEST(CheckGates, TightensUpperAndLowerLimitsByGuardBand) {
  const auto of = [](const char* metric, double limit, double value) {
    return check_against_gates({{metric, limit, GuardBand{0.01, 1.5}}}, {{metric, value}},
                               {find_metric_kind(metric).value()})[0];
  };
  EXPECT_TRUE(of("rms_px", 0.3, 0.2849).has_passed_gate());
  const CheckedMetric within = of("rms_px", 0.3, 0.286);
  EXPECT_FALSE(within.has_passed_gate());
  EXPECT_EQ(describe_gate(within),
            "rms_px is 0.286 px, at most 0.3 px less a guard band of 0.015 px is required");
  EXPECT_FALSE(check_gates({{"rms_px", 0.3, GuardBand{0.01, 1.5}}}, {{"rms_px", 0.286}})[0]
                   .has_passed_gate());
  EXPECT_TRUE(of("coverage", 0.7, 0.7151).has_passed_gate());
  const CheckedMetric below = of("coverage", 0.7, 0.714);
  EXPECT_FALSE(below.has_passed_gate());
  EXPECT_EQ(describe_gate(below),
            "coverage is 0.714, at least 0.7 and a guard band of 0.015 is required");
  // Tables of the normal distribution.
  EXPECT_NEAR(of("rms_px", 0.3, 0.286).conformance_probability().value(), 0.91924, 5e-6);
  EXPECT_NEAR(of("coverage", 0.7, 0.714).conformance_probability().value(), 0.91924, 5e-6);
  EXPECT_NEAR(of("rms_px", 0.3, 0.32).conformance_probability().value(), 0.02275, 5e-6);
  EXPECT_EQ(of("rms_px", 0.3, 0.3).conformance_probability(), 0.5);
  EXPECT_FALSE(check_gates({{"rms_px", 0.3}}, {{"rms_px", 0.1}})[0].conformance_probability());
}

/// Absolute values are folded at zero: of measured values near 0.05 with u = 0.1, 62.5 % have true
/// values up to 0.1, and not 69 %. The standard deviation is 1 %.
TEST(ConformanceProbability, MatchesSimulatedAbsoluteValues) {
  constexpr double limit = 0.1, u = 0.1;
  CheckedMetric unit = check_gates({{"rms_px", limit, GuardBand{u, 1}}}, {})[0];
  Random random(12);
  int near = 0, conforming = 0;
  for (int i = 0; i < 300'000; ++i) {
    const double truth = random.uniform(0, 1), measured = std::abs(truth + u * random.normal());
    if (std::abs(measured - 0.05) > 0.005) continue;
    ++near;
    conforming += truth <= limit ? 1 : 0;
  }
  ASSERT_GT(near, 1000);
  unit.value = 0.05;
  EXPECT_NEAR(unit.conformance_probability().value(), conforming / double(near), 0.03);
}

/// Draws units of any quality and measures them with an uncertainty. Compares the number of false
/// passes and false failures with the sum of their reported probabilities.
TEST(ConformanceProbability, MatchesSimulatedDecisionErrors) {
  constexpr double limit = 1, u = 0.05, k = 1.645;
  CheckedMetric unit = check_gates({{"rms_px", limit, GuardBand{u, k}}}, {})[0];
  Random random(11);
  constexpr int clusters = 300'000;
  double passed_falsely = 0, stated_passed = 0, failed_falsely = 0, stated_failed = 0;
  int passed_at_limit = 0;
  for (int i = 0; i < clusters; ++i) {
    const double truth = random.uniform(limit - 5 * u, limit + 5 * u);
    unit.value = truth + u * random.normal();
    const double conforms = unit.conformance_probability().value();
    if (unit.has_passed_gate()) {
      passed_falsely += truth > limit ? 1 : 0;
      stated_passed += 1 - conforms;
    } else {
      failed_falsely += truth <= limit ? 1 : 0;
      stated_failed += conforms;
    }
    unit.value = limit + u * random.normal();
    passed_at_limit += unit.has_passed_gate() ? 1 : 0;
  }
  // 630 units pass falsely: their number has a standard error of 4 %.
  EXPECT_NEAR(passed_falsely / stated_passed, 1, 0.1);
  EXPECT_NEAR(failed_falsely / stated_failed, 1, 0.1);
  EXPECT_NEAR(double(passed_at_limit) / clusters, 0.05, 0.005);
}

TEST(CheckAgainstGates, IncludesMetricsWithoutGateAndGatesWithoutValue) {
  const double infinity = std::numeric_limits<double>::infinity();
  const auto known = list_metric_kinds({MetricSource::lens, MetricSource::rotation});
  const auto all =
      check_against_gates({{"rms_px", 0.3}}, {{"tilt_deg", 1}, {"rms_px", infinity}}, known);
  ASSERT_EQ(all.size(), 2);
  EXPECT_EQ(all[0].name, "rms_px");
  EXPECT_FALSE(all[0].value);
  EXPECT_FALSE(all[0].has_passed_gate());
  EXPECT_EQ(describe_failed_gates(all), "rms_px is not known, at most 0.3 px is required");
  EXPECT_EQ(all[1].value, 1);
  EXPECT_FALSE(all[1].limit);
  EXPECT_TRUE(all[1].has_passed_gate());
}

TEST(MergeGates, ReplacesLimitsAndAppendsNewGates) {
  const auto gates =
      merge_gates({{"rms_px", 1}, {"split_half_px", 1}}, {{"coverage", 0.6}, {"rms_px", 2}});
  ASSERT_EQ(gates.size(), 3);
  EXPECT_EQ(gates[0].limit, 2);
  EXPECT_EQ(gates[1].limit, 1);
  EXPECT_EQ(gates[2].metric, "coverage");
}

TEST(CheckGates, FailsComparisonOnlyForManyClustersAndRelevantDifference) {
  Evaluation compared = evaluation();
  compared.comparison = Comparison{};
  QuantityComparison& horizontal = compared.comparison->quantities[0];
  horizontal.min_relevant = 1e-6;
  const auto passed = [&] {
    return check_gates({{"worse_mm", 0}}, collect_metrics(compared))[0].has_passed_gate();
  };
  EXPECT_FALSE(find_metric_value(collect_metrics(compared), "worse_mm")) << "no pair";
  compared.comparison->pairs = horizontal.pairs = horizontal.clusters = 19;
  horizontal.interval = {0.1, 1};
  EXPECT_TRUE(passed());
  horizontal.interval = {};
  EXPECT_TRUE(passed());
  horizontal.clusters = 20;
  horizontal.interval = {0.1, 1};
  EXPECT_FALSE(passed());
  horizontal.interval = {1e-7, 2.4e-7};  // of no matter
  EXPECT_TRUE(passed());
}

TEST(MakeComparisonGates, HasOneForEachMeasuredMetricOfComparison) {
  EXPECT_TRUE(make_comparison_gates(collect_metrics(evaluation())).empty());
  Evaluation compared = evaluation();
  compared.comparison = Comparison{};
  compared.comparison->pairs = compared.comparison->quantities[1].pairs = 1;
  std::vector<std::string> names;
  for (const Gate& gate : make_comparison_gates(collect_metrics(compared))) {
    EXPECT_EQ(gate.limit, 0);
    names.push_back(gate.metric);
  }
  EXPECT_THAT(names, testing::ElementsAre("worse_height_mm", "unpaired_fraction"));
}

TEST(ParseGate, RejectsLimitOutsideRangeAndFormerOrUnknownMetric) {
  const auto known = list_metric_kinds({MetricSource::lens, MetricSource::evaluation});
  const auto words = [&](const char* text) -> std::string {
    try {
      return parse_gate(text, known).metric;
    } catch (const std::invalid_argument& problem) {
      return problem.what();
    }
  };
  EXPECT_EQ(words("missing_fraction=50"),
            "gate 'missing_fraction' should be a fraction from 0 to 1, not 50: for 50 % say 0.5");
  EXPECT_EQ(words("coverage=7"),
            "gate 'coverage' should be a fraction from 0 to 1, not 7: for 7 % say 0.07");
  EXPECT_EQ(words("yaw_rms_deg=200"), "gate 'yaw_rms_deg' should be at most 180 deg, not 200");
  EXPECT_THAT(words("mean_mm=-1"), HasSubstr("gate 'mean_mm' should not be negative"));
  EXPECT_EQ(words("mtf50=0"), "gate 'mtf50' should be above 0, which is always met");
  EXPECT_THAT(words("mising=0"), HasSubstr("gate 'mising' is not known"));
  EXPECT_EQ(parse_gate("missing_fraction=1", known).limit, 1);
  EXPECT_EQ(parse_gate("normalized_error_rms=50", known).limit, 50);
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    return rejection_message(
        [&] { read_gates(folder.file("g.yaml", "format: vlp-gates/1\ngates:\n" + text), known); });
  };
  EXPECT_THAT(refusal("  mean_mm: 1\n  missing_fraction: 1.5\n"),
              HasSubstr("g.yaml:4: gates.missing_fraction: should be a fraction from 0 to 1"));
  EXPECT_THAT(refusal("  yaw_rms_deg: -0.5\n"),
              HasSubstr("g.yaml:3: gates.yaw_rms_deg: should not be negative"));
}

TEST(CheckGates, FailsGateWithoutValue) {
  const CheckedMetric gate = check_gates({{"split_half_px", 1}}, {{"rms_px", 0.1}})[0];
  EXPECT_EQ(describe_gate(gate), "split_half_px is not known, at most 1 px is required");
  const auto json = nlohmann::json::parse(format_evaluation(evaluation(), {gate}));
  EXPECT_TRUE(json["gates"][0]["value"].is_null());
  EXPECT_EQ(json["passed"], false);
  const auto tests = make_gate_tests(std::vector{gate});
  ASSERT_EQ(tests.size(), 1);
  EXPECT_THAT(tests[0].message, HasSubstr("split_half_px is not known, at most 1 px"));
}

TEST(ParseGate, ReturnsMetricAndLimitAndThrowsForInvalidText) {
  const auto known = list_metric_kinds({MetricSource::evaluation});
  const Gate gate = parse_gate("p90_mm=2.5", known);
  EXPECT_EQ(gate.metric, "p90_mm");
  EXPECT_EQ(gate.limit, 2.5);
  for (const char* bad : {"mean=1", "mean_mm", "mean_mm=", "mean_mm=x", "mean_mm=1mm",
                          "mean_mm=nan", "mean_mm=inf", "rms_px=1", "=1", ""}) {
    EXPECT_THROW(parse_gate(bad, known), std::invalid_argument) << bad;
  }
}

TEST(ReadGates, ReturnsGatesOfFileAndRejectsInvalidFiles) {
  const TemporaryFolder folder;
  const auto known = list_metric_kinds({MetricSource::evaluation});
  const auto gates = read_gates(
      folder.file("g.yaml", "format: vlp-gates/1\ngates: {missing_fraction: 0, mean_mm: 1.5}\n"),
      known);
  ASSERT_EQ(gates.size(), 2);
  EXPECT_EQ(gates[0].metric, "mean_mm");
  EXPECT_EQ(gates[0].limit, 1.5);
  const auto refusal = [&](const std::string& text) {
    return rejection_message(
        [&] { read_gates(folder.file("g.yaml", "format: vlp-gates/1\n" + text), known); });
  };
  EXPECT_THAT(refusal("gates:\n  mean_mm: 1\n  mean_cm: 1\n"),
              HasSubstr("g.yaml:4: gates: key 'mean_cm'"));
  EXPECT_THAT(refusal("gates:\n  mean_cm: 1\n"), HasSubstr("p90_mm"));
  EXPECT_THAT(refusal("gates: {mean_mm: much}\n"), HasSubstr("g.yaml:2: gates.mean_mm"));
  EXPECT_THAT(refusal("gates: {}\n"), HasSubstr("contains no gate"));
}

TEST(FormatEvaluation, WritesMetricsWithUnitsInKeys) {
  const auto json = nlohmann::json::parse(format_evaluation(
      evaluation(),
      check_gates({{"max_mm", 5}, {"missing_fraction", 1}}, collect_metrics(evaluation()))));
  EXPECT_EQ(json["format"], "vlp-evaluation/4");
  EXPECT_EQ(json["captures"], 4);
  EXPECT_EQ(json["missing"]["degenerate"], 1);
  EXPECT_NEAR(json["horizontal"]["mean_mm"].get<double>(), 3, 1e-9);
  EXPECT_NEAR(json["height"]["bias_mm"].get<double>(), 3, 1e-9);
  EXPECT_EQ(json["bias_and_repeatability"]["reference_points"], 1);
  EXPECT_FALSE(json.contains("yaw"));
  EXPECT_EQ(json["gates"][0]["passed"], false);
  EXPECT_EQ(json["passed"], false);
}

TEST(FormatEvaluation, OmitsMissingP90IntervalAndStatesTooFewClusters) {
  Evaluation few = evaluation();
  const Interval interval{0.001, 0.002};
  few.intervals_m = {interval, interval, {}, interval, 19};
  few.comparison = Comparison{};
  const auto json = nlohmann::json::parse(format_evaluation(few, {}));
  EXPECT_FALSE(json["horizontal"]["intervals_95"].contains("p90_mm"));
  EXPECT_NEAR(json["horizontal"]["intervals_95"]["rms_mm"][1].get<double>(), 2, 1e-9);
  EXPECT_EQ(json["comparison"]["horizontal"]["reason"], "too few clusters");
  few.intervals_m->p90 = interval;
  few.comparison->quantities[0].clusters = 20;
  const auto sufficient = nlohmann::json::parse(format_evaluation(few, {}));
  EXPECT_NEAR(sufficient["horizontal"]["intervals_95"]["p90_mm"][0].get<double>(), 1, 1e-9);
  EXPECT_FALSE(sufficient["comparison"]["horizontal"].contains("reason"));
}

}  // namespace
}  // namespace vlp
