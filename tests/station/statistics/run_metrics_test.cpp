// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/run_metrics.h"

#include <gmock/gmock.h>

#include <stdexcept>

#include "station/sample_records.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::SizeIs;

/// Records of four runs: three of camera a, of which the last is INVALID, and a failed one of b.
class RunMetrics : public testing::Test {
 protected:
  RunMetrics() {
    keep(1, "a", 0.1);
    keep(2, "b", 2);
    keep(3, "a", 0.3);
    keep(4, "a", 0.4, "INVALID");
  }
  void keep(int number, const std::string& camera, double rms_px, const std::string& verdict = "") {
    RunRecord run = make_sample_record(numbered_run_id(number), camera, rms_px);
    if (!verdict.empty()) run.verdict = verdict;
    records.store_run(run);
  }
  std::vector<TrendPoint> judged(const RunFilter& filter = {}) {
    return load_metric_values(records, "rms_px", filter);
  }

  TemporaryFolder folder;
  Records records{(folder / "records.db").string()};
};

TEST_F(RunMetrics, ExtractTrendValuesExcludesInvalidRunsUnlessRequested) {
  EXPECT_THAT(extract_trend_values(judged()), ElementsAre(0.1, 2, 0.3));
  RunFilter two, invalid;
  two.last = 2;
  invalid.verdict = "INVALID";
  EXPECT_THAT(extract_trend_values(judged(two)), ElementsAre(2, 0.3)) << "of those, the last";
  EXPECT_THAT(extract_trend_values(judged(invalid)), ElementsAre(0.4));
}

TEST_F(RunMetrics, FindGateLimitPrefersStationToLastRun) {
  EXPECT_EQ(find_gate_limit("rms_px", nullptr, records, judged()), 1);
  EXPECT_FALSE(find_gate_limit("coverage", nullptr, records, judged()))
      << "a figure without a gate";
  EXPECT_FALSE(find_gate_limit("rms_px", nullptr, records, {}));
  StationConfig station;
  station.gates = {{"rms_px", 0.7}};
  EXPECT_EQ(find_gate_limit("rms_px", &station, records, judged()), 0.7);
  EXPECT_FALSE(find_gate_limit("tilt_deg", &station, records, judged()));
  EXPECT_EQ(make_specification_limits(require_run_metric_kind("rms_px"), 0.7).upper, 0.7);
  EXPECT_FALSE(make_specification_limits(require_run_metric_kind("rms_px"), 0.7).lower);
  EXPECT_EQ(make_specification_limits(require_run_metric_kind("coverage"), 0.7).lower, 0.7);
}

using CheckOneStation = RunMetrics;

TEST_F(CheckOneStation, ThrowsForTwoStations) {
  auto points = judged();
  EXPECT_NO_THROW(check_one_station(points));
  EXPECT_NO_THROW(check_one_station({}));
  points[1].station = "station-2";
  EXPECT_THROW(check_one_station(points), std::invalid_argument);
}

TEST_F(RunMetrics, SelectStudyValuesReturnsRequestedOrRepeatedUnits) {
  EXPECT_THAT(select_study_values(judged(), {}),
              AllOf(SizeIs(2), testing::Each(Field(&StudyValue::unit, "a"))));
  EXPECT_THAT(select_study_values(judged(), {"b"}), ElementsAre(Field(&StudyValue::unit, "b")));
  EXPECT_THAT(
      [&] {
        select_study_values(judged(), {"c", "a", "d"});
      },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("is of: c, d")));
  const auto values = select_reference_values(judged(), {{"a", 0.2}});
  ASSERT_THAT(values, SizeIs(2));
  EXPECT_EQ(values[0].reference, 0.2);
  EXPECT_THROW(select_reference_values(judged(), {{"c", 0.2}}), std::invalid_argument);
}

TEST(RequireRunMetricKind, ThrowsNamingKnownMetrics) {
  EXPECT_STREQ(require_run_metric_kind("check_mean_mm").unit, "mm");
  EXPECT_THAT([] { require_run_metric_kind("rms_um"); },
              testing::ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("there is no metric rms_um"), HasSubstr("rms_px"))));
}

/// sample() has the same images in each run.
TEST_F(RunMetrics, CheckNoSharedImagesThrowsForSameImages) {
  const auto points = judged();
  const auto values = select_study_values(points, {});
  ASSERT_THAT(values, SizeIs(2));
  EXPECT_THAT(rejection_message<std::invalid_argument>(
                  [&] { check_no_shared_images(records, points, values); }),
              HasSubstr("runs " + numbered_run_id(1) + " and " + numbered_run_id(3) +
                        " of camera a have the same images, which is no repetition"));
  EXPECT_EQ(rejection_message<std::invalid_argument>([&] {
              check_no_shared_images(records, points, select_study_values(points, {"b"}));
            }),
            "");
}

TEST(CountRuns, ExcludesVoidedRunsFromYield) {
  const std::vector<RunSummary> runs{{"1", "unit", "", "", "", "PASS", "", ""},
                                     {"2", "unit", "", "", "", "PASS", "", ""},
                                     {"3", "unit", "", "", "", "FAIL", "", ""},
                                     {"4", "unit", "", "", "", "FAIL", "", "wrong serial"},
                                     {"5", "unit", "", "", "", "INVALID", "", ""},
                                     {"6", "golden", "", "", "", "PASS", "", ""}};
  const RunCounts counts = count_runs(runs);
  EXPECT_EQ(counts.passed, 3U);
  EXPECT_EQ(counts.failed, 1U);
  EXPECT_EQ(counts.invalid, 1U);
  EXPECT_EQ(counts.voided, 1U);
  EXPECT_EQ(counts.units_judged, 3U);
  EXPECT_DOUBLE_EQ(counts.compute_yield().value(), 2.0 / 3);
  EXPECT_FALSE(count_runs({}).compute_yield());
}

TEST(CountRuns, CountsReworkedCamerasAndFirstPassYield) {
  const std::vector<RunSummary> runs{{"1", "unit", "", "a", "", "PASS", "", ""},
                                     {"2", "unit", "", "b", "", "FAIL", "", ""},
                                     {"3", "unit", "", "b", "", "PASS", "", ""},
                                     {"4", "unit", "", "c", "", "INVALID", "", ""},
                                     {"5", "unit", "", "c", "", "PASS", "", ""},
                                     {"6", "unit", "", "d", "", "FAIL", "", "wrong serial"},
                                     {"7", "golden", "", "g", "", "FAIL", "", ""}};
  const RunCounts counts = count_runs(runs);
  EXPECT_EQ(counts.cameras, 3U);
  EXPECT_EQ(counts.cameras_reworked, 1U);
  EXPECT_DOUBLE_EQ(counts.compute_first_pass_yield().value(), 2.0 / 3);
  EXPECT_FALSE(count_runs({}).compute_first_pass_yield());
}

}  // namespace
}  // namespace vlp
