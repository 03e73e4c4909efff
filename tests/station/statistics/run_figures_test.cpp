// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/run_figures.h"

#include <gmock/gmock.h>

#include <stdexcept>

#include "station/sample_records.h"
#include "support/refused.h"

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
    RunRecord run = sample(run_of(number), camera, rms_px);
    if (!verdict.empty()) run.verdict = verdict;
    records.keep(run);
  }
  std::vector<TrendPoint> judged(const RunFilter& filter = {}) {
    return judged_values(records, "rms_px", filter);
  }

  TemporaryFolder folder;
  Records records{(folder / "records.db").string()};
};

TEST_F(RunMetrics, JudgedValuesExcludesInvalidRuns) {
  EXPECT_THAT(values_of(judged()), ElementsAre(0.1, 2, 0.3));
  RunFilter two, invalid;
  two.last = 2;
  invalid.verdict = "INVALID";
  EXPECT_THAT(values_of(judged(two)), ElementsAre(2, 0.3)) << "of those, the last";
  EXPECT_THAT(values_of(judged(invalid)), ElementsAre(0.4));
}

TEST_F(RunMetrics, FindGateReturnsGateOfStationOrLastRun) {
  EXPECT_EQ(gate_of("rms_px", nullptr, records, judged()), 1);
  EXPECT_FALSE(gate_of("coverage", nullptr, records, judged())) << "a figure without a gate";
  EXPECT_FALSE(gate_of("rms_px", nullptr, records, {}));
  StationConfig station;
  station.gates = {{"rms_px", 0.7}};
  EXPECT_EQ(gate_of("rms_px", &station, records, judged()), 0.7);
  EXPECT_FALSE(gate_of("tilt_deg", &station, records, judged()));
  EXPECT_EQ(limits_of(run_figure("rms_px"), 0.7).upper, 0.7);
  EXPECT_FALSE(limits_of(run_figure("rms_px"), 0.7).lower);
  EXPECT_EQ(limits_of(run_figure("coverage"), 0.7).lower, 0.7);
}

TEST_F(RunMetrics, CheckOneStationThrowsForTwoStations) {
  auto points = judged();
  EXPECT_NO_THROW(check_one_station(points));
  EXPECT_NO_THROW(check_one_station({}));
  points[1].station = "station-2";
  EXPECT_THROW(check_one_station(points), std::invalid_argument);
}

TEST_F(RunMetrics, StudyValuesSelectsUnitsWithRepeatedRuns) {
  EXPECT_THAT(study_values(judged(), {}),
              AllOf(SizeIs(2), testing::Each(Field(&StudyValue::unit, "a"))));
  EXPECT_THAT(study_values(judged(), {"b"}), ElementsAre(Field(&StudyValue::unit, "b")));
  EXPECT_THAT(
      [&] {
        study_values(judged(), {"c", "a", "d"});
      },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("is of: c, d")));
  const auto values = reference_values(judged(), {{"a", 0.2}});
  ASSERT_THAT(values, SizeIs(2));
  EXPECT_EQ(values[0].reference, 0.2);
  EXPECT_THROW(reference_values(judged(), {{"c", 0.2}}), std::invalid_argument);
}

TEST(RunMetric, ThrowsWithListOfMetricsForUnknownName) {
  EXPECT_STREQ(run_figure("check_mean_mm").unit, "mm");
  EXPECT_THAT([] { run_figure("rms_um"); },
              testing::ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("there is no figure rms_um"), HasSubstr("rms_px"))));
}

/// sample() has the same images in each run.
TEST_F(RunMetrics, CheckRepetitionsThrowsForSameImages) {
  const auto points = judged();
  const auto values = study_values(points, {});
  ASSERT_THAT(values, SizeIs(2));
  EXPECT_THAT(
      refusal_of<std::invalid_argument>([&] { check_repetitions(records, points, values); }),
      HasSubstr("runs " + run_of(1) + " and " + run_of(3) +
                " of camera a have the same images, which is no repetition"));
  EXPECT_EQ(refusal_of<std::invalid_argument>(
                [&] { check_repetitions(records, points, study_values(points, {"b"})); }),
            "");
}

}  // namespace
}  // namespace vlp
