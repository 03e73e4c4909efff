// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/check_gates.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include "evaluation/evaluation_files.h"
#include "support/refused.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// Three fixes of four captures, off by 1, 2 and 6 mm; only the first's height is known, 3 mm off.
Evaluation evaluation() {
  EvaluationInput input;
  input.fixes.rows = {{"a", "ok", FixRow::Fix{{{1e-3, 0, 3e-3}, 0}, {}, 0}, 3},
                      {"b", "ok", FixRow::Fix{{{0, -2e-3, 0}, 0}, {}, 0}, 3},
                      {"c", "ok", FixRow::Fix{{{0, 6e-3, 0}, 0}, {}, 0}, 3},
                      {"d", "degenerate", {}, 0}};
  input.truth = FromFile<TruthRow>{
      "truth.csv",
      {{"a", {0, 0}, 0, {}}, {"b", {0, 0}, {}, {}}, {"c", {0, 0}, {}, {}}, {"d", {0, 0}, {}, {}}}};
  return evaluate(input);
}

TEST(Gates, HoldWhenTheFigureIsNoLarger) {
  const auto results = check_gates({{"mean_mm", 3.001},
                                    {"mean_mm", 2.999},
                                    {"p90_mm", 6.001},
                                    {"missing", 0.25},
                                    {"missing", 0.249},
                                    {"height_rms_mm", 2.9}},
                                   evaluation());
  std::vector<bool> passed;
  for (const GateResult& result : results) passed.push_back(result.passed);
  EXPECT_EQ(passed, (std::vector<bool>{true, false, true, true, false, false}));
  EXPECT_NEAR(results[5].value, 3, 1e-9);
  EXPECT_EQ(results[5].unit, "mm");
  EXPECT_EQ(words_of(results[5]), "height_rms_mm is 3 mm, at most 2.9 mm is asked for");
}

TEST(Gates, AreRefusedWhereThereIsNoSuchFigure) {
  for (const char* name : {"yaw_rms_deg", "limit_ratio", "fitted_mean_mm", "worse_mm"}) {
    EXPECT_THROW(check_gates({{name, 1}}, evaluation()), std::invalid_argument) << name;
  }
}

TEST(Gates, OfAComparisonOfTooFewDoNotFail) {
  Evaluation compared = evaluation();
  compared.comparison = Comparison{};
  EXPECT_THROW(check_gates({{"worse_mm", 0}}, compared), std::invalid_argument);  // no pair
  compared.comparison->pairs = compared.comparison->units = 19;
  compared.comparison->interval_m = {0.1, 1};
  EXPECT_TRUE(check_gates({{"worse_mm", 0}}, compared)[0].passed);
  compared.comparison->interval_m = {};
  EXPECT_TRUE(check_gates({{"worse_mm", 0}}, compared)[0].passed);
  compared.comparison->units = 20;
  compared.comparison->interval_m = {0.1, 1};
  EXPECT_FALSE(check_gates({{"worse_mm", 0}}, compared)[0].passed);
}

TEST(Gates, HaveLimitsThatAFigureCanReach) {
  const auto words = [](const char* text) -> std::string {
    try {
      return gate_of(text).name;
    } catch (const std::invalid_argument& problem) {
      return problem.what();
    }
  };
  EXPECT_EQ(words("missing=50"),
            "gate 'missing' should be a share from 0 to 1, not 50: for 50 % say 0.5");
  EXPECT_THAT(words("mean_mm=-1"), HasSubstr("gate 'mean_mm' should not be negative"));
  EXPECT_EQ(gate_of("missing=1").limit, 1);
  EXPECT_EQ(gate_of("stated_ratio=50").limit, 50);
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    return refusal_of(
        [&] { read_gates(folder.file("g.yaml", "format: vlp-gates/1\ngates:\n" + text)); });
  };
  EXPECT_THAT(refusal("  mean_mm: 1\n  missing: 1.5\n"),
              HasSubstr("g.yaml:4: gates.missing: should be a share from 0 to 1"));
  EXPECT_THAT(refusal("  yaw_rms_deg: -0.5\n"),
              HasSubstr("g.yaml:3: gates.yaw_rms_deg: should not be negative"));
}

TEST(Gates, OfWhatIsNotKnownAreNotMet) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const GateResult gate{"halves_px", "px", none, 1, false};
  EXPECT_EQ(words_of(gate), "halves_px is not known, at most 1 px is asked for");
  const auto json = nlohmann::json::parse(json_of(evaluation(), {gate}));
  EXPECT_TRUE(json["gates"][0]["value"].is_null());
  EXPECT_EQ(json["passed"], false);
  EXPECT_THAT(junit_of({gate}), HasSubstr("message=\"halves_px is not known, at most 1 px"));
}

TEST(Gates, AreReadFromWords) {
  const Gate gate = gate_of("p90_mm=2.5");
  EXPECT_EQ(gate.name, "p90_mm");
  EXPECT_EQ(gate.limit, 2.5);
  for (const char* bad : {"mean=1", "mean_mm", "mean_mm=", "mean_mm=x", "mean_mm=1mm",
                          "mean_mm=nan", "mean_mm=inf", "=1", ""}) {
    EXPECT_THROW(gate_of(bad), std::invalid_argument) << bad;
  }
}

TEST(Gates, AreReadFromAFile) {
  const TemporaryFolder folder;
  const auto gates =
      read_gates(folder.file("g.yaml", "format: vlp-gates/1\ngates: {missing: 0, mean_mm: 1.5}\n"));
  ASSERT_EQ(gates.size(), 2);
  EXPECT_EQ(gates[0].name, "mean_mm");
  EXPECT_EQ(gates[0].limit, 1.5);
  const auto refusal = [&](const std::string& text) {
    return refusal_of([&] { read_gates(folder.file("g.yaml", "format: vlp-gates/1\n" + text)); });
  };
  EXPECT_THAT(refusal("gates:\n  mean_mm: 1\n  mean_cm: 1\n"),
              HasSubstr("g.yaml:4: gates: key 'mean_cm'"));
  EXPECT_THAT(refusal("gates:\n  mean_cm: 1\n"), HasSubstr("p90_mm"));
  EXPECT_THAT(refusal("gates: {mean_mm: much}\n"), HasSubstr("g.yaml:2: gates.mean_mm"));
  EXPECT_THAT(refusal("gates: {}\n"), HasSubstr("holds no gate"));
}

TEST(EvaluationFiles, AreJsonWithUnitsInTheKeys) {
  const auto json = nlohmann::json::parse(
      json_of(evaluation(), check_gates({{"max_mm", 5}, {"missing", 1}}, evaluation())));
  EXPECT_EQ(json["format"], "vlp-evaluation/1");
  EXPECT_EQ(json["captures"], 4);
  EXPECT_EQ(json["missing"]["degenerate"], 1);
  EXPECT_NEAR(json["horizontal"]["mean_mm"].get<double>(), 3, 1e-9);
  EXPECT_NEAR(json["height"]["bias_mm"].get<double>(), 3, 1e-9);
  EXPECT_EQ(json["repeated"]["stations"], 1);
  EXPECT_FALSE(json.contains("yaw"));
  EXPECT_EQ(json["gates"][0]["passed"], false);
  EXPECT_EQ(json["passed"], false);
}

TEST(EvaluationFiles, HaveNoIntervalOfP90OfFewUnits) {
  Evaluation few = evaluation();
  const Interval interval{0.001, 0.002};
  few.intervals_m = {interval, interval, {}, interval, 19};
  few.comparison = Comparison{};
  const auto json = nlohmann::json::parse(json_of(few, {}));
  EXPECT_FALSE(json["horizontal"]["intervals_95"].contains("p90_mm"));
  EXPECT_NEAR(json["horizontal"]["intervals_95"]["rms_mm"][1].get<double>(), 2, 1e-9);
  EXPECT_EQ(json["comparison"]["why"], "too few");
  few.intervals_m->p90 = interval;
  few.comparison->units = 20;
  const auto enough = nlohmann::json::parse(json_of(few, {}));
  EXPECT_NEAR(enough["horizontal"]["intervals_95"]["p90_mm"][0].get<double>(), 1, 1e-9);
  EXPECT_FALSE(enough["comparison"].contains("why"));
}

TEST(EvaluationFiles, AreJUnitWithATestForEachGate) {
  pugi::xml_document document;
  const std::string text =
      junit_of({{"mean_mm", "mm", 1.25, 1, false}, {"missing", "", 0, 0, true}});
  ASSERT_TRUE(document.load_string(text.c_str()));
  const pugi::xml_node suite = document.child("testsuites").child("testsuite");
  EXPECT_EQ(suite.attribute("tests").as_int(), 2);
  EXPECT_EQ(suite.attribute("failures").as_int(), 1);
  const pugi::xml_node first = suite.child("testcase"), second = first.next_sibling("testcase");
  EXPECT_STREQ(first.attribute("name").value(), "mean_mm");
  EXPECT_STREQ(first.child("failure").attribute("message").value(),
               "mean_mm is 1.25 mm, at most 1 mm is asked for");
  EXPECT_FALSE(second.child("failure"));
}

}  // namespace
}  // namespace vlp
