// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/evaluation_figures.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

/// Formats a row as one text.
std::vector<std::string> texts(const std::vector<ReportStatistic>& figures) {
  std::vector<std::string> lines;
  for (const auto& [label, value, unit, interval] : figures) {
    lines.push_back(label + " | " + value + " | " + unit + " | " + interval);
  }
  return lines;
}

Evaluation evaluation() {
  Evaluation evaluation;
  evaluation.reference = "truth";
  evaluation.resampling_unit = "captures";
  evaluation.captures = 10;
  evaluation.fixes = 8;
  evaluation.failures_by_status = {{"degenerate", 1}, {"no row", 1}};
  evaluation.horizontal_m = {8, 0.001, 0.002, 0.003, 0.004, 0.005};
  return evaluation;
}

TEST(ListStatistics, FormatsErrorsInMillimetersAndOmitsMissingIntervals) {
  EXPECT_THAT(
      texts(list_statistics(evaluation())),
      ElementsAre("captures | 10 |  | ", "without a fix | 2 |  | ",
                  "horizontal error, mean | 1 | mm | ", "horizontal error, median | 2 | mm | ",
                  "horizontal error, 90th percentile | 3 | mm | ",
                  "horizontal error, root mean square | 5 | mm | ",
                  "horizontal error, largest | 4 | mm | "));
}

TEST(ListStatistics, AddsIntervalToEachStatisticThatHasOne) {
  Evaluation full = evaluation();
  full.intervals_m = {{0.001, 0.002}, {0.003, 0.004}, Interval{0.005, 0.006}, {0.007, 0.008}, 5};
  full.resampling_unit = "reference points";
  const auto lines = texts(list_statistics(full));
  EXPECT_THAT(lines, Contains("horizontal error, median | 2 | mm | 3 to 4"));
  EXPECT_THAT(lines, Contains("horizontal error, root mean square | 5 | mm | 7 to 8"));
  EXPECT_THAT(lines, Contains("horizontal error, 90th percentile | 3 | mm | 5 to 6"));
  EXPECT_THAT(make_evaluation_notes(full),
              Contains(HasSubstr("bootstrap over 5 reference points")));
  EXPECT_THAT(make_evaluation_notes(full),
              Contains(HasSubstr("Caution: with only 5 reference points")));
  full.intervals_m->p90 = {};
  EXPECT_THAT(texts(list_statistics(full)),
              Contains("horizontal error, 90th percentile | 3 | mm | "));
  full.comparison = Comparison{};
  EXPECT_THAT(
      make_evaluation_notes(full),
      Contains(HasSubstr(
          "other fixes: horizontal error inconclusive, too few; 0 captures have a fix in both")));
}

TEST(MakeEvaluationNotes, StatesReferenceMissingFixesAndMissingIntervals) {
  const auto notes = make_evaluation_notes(evaluation());
  EXPECT_THAT(notes, ElementsAre("Horizontal errors are distances from the true place, by image.",
                                 "Captures without a fix: 1 degenerate, 1 no row.",
                                 "Caution: there are too few captures with a fix for intervals."));
}

TEST(ListDriveStatistics, LabelsBeginWithFileName) {
  LineFit fit{};
  fit.distances_m = {1001, 0.001, 0.002, 0.003, 0.004, 0.005};
  fit.jitter_m = 0.006;
  EXPECT_THAT(texts(list_drive_statistics("a.csv", fit)),
              ElementsAre("a.csv: fitted line from the commanded one, mean | 1 | mm | ",
                          "a.csv: the same, 90th percentile | 3 | mm | ",
                          "a.csv: jitter across the fitted line, root mean square | 6 | mm | "));
}

}  // namespace
}  // namespace vlp
