// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/sample_size_warnings.h"

#include <gmock/gmock.h>

#include "evaluation/gate.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Evaluation evaluation(std::size_t clusters) {
  Evaluation evaluation;
  evaluation.captures = 432;
  evaluation.fixes = 39;
  evaluation.reference = "truth";
  evaluation.resampling_unit = "reference points";
  const Interval interval{0, 1};
  evaluation.intervals_m = {interval, interval, {}, interval, clusters};
  if (clusters >= kMinClustersForP90) evaluation.intervals_m->p90 = interval;
  return evaluation;
}

TEST(WarnAboutMissingFixes, WarnsIfNoneOfTheGatesLimitsMissingFixes) {
  const auto gates = check_gates({{"mean_mm", 2}, {"missing_fraction", 1}},
                                 {{"mean_mm", 1}, {"missing_fraction", 0.9}});
  const CheckedMetric &mean = gates[0], &missing = gates[1];
  EXPECT_EQ(warn_about_missing_fixes(evaluation(50), {mean}),
            "393 of 432 captures have no fix, and there is no gate 'missing_fraction'");
  EXPECT_EQ(warn_about_missing_fixes(evaluation(50), {mean, missing}), "");
  EXPECT_EQ(warn_about_missing_fixes(evaluation(50), {}), "");
  Evaluation all = evaluation(50);
  all.fixes = all.captures - 1;
  EXPECT_THAT(warn_about_missing_fixes(all, {mean}), HasSubstr("1 of 432 captures has no fix"));
  all.fixes = all.captures;
  EXPECT_EQ(warn_about_missing_fixes(all, {mean}), "");
}

TEST(WarnAboutSampleSize, WarnsForFewerThanFiftyReferencePoints) {
  EXPECT_THAT(warn_about_sample_size(evaluation(50)), IsEmpty());
  EXPECT_THAT(
      warn_about_sample_size(evaluation(49)),
      ElementsAre("with only 49 reference points the interval of p90 is somewhat too narrow"));
  EXPECT_THAT(warn_about_sample_size(evaluation(19)),
              ElementsAre(HasSubstr("p90 has no interval")));
  Evaluation path = evaluation(30);  // as many runs as a path ever has
  path.reference = "path";
  EXPECT_THAT(warn_about_sample_size(path), IsEmpty());
  Evaluation none = evaluation(4);
  none.intervals_m = {};
  EXPECT_THAT(warn_about_sample_size(none),
              ElementsAre("there are too few reference points with a fix for intervals"));
}

TEST(WarnAboutCrlb, WarnsIfErrorsAreSignificantlyBelowCrlb) {
  Evaluation limited = evaluation(1000);
  EXPECT_EQ(warn_about_crlb(limited), "");
  limited.crlb_ratio = CrlbRatio{0.609, 1e-3, 36, 1.0 / 12};
  EXPECT_THAT(warn_about_crlb(limited),
              AllOf(HasSubstr("0.609 times the theoretical limit: either the stated pixel noise is "
                              "too large, or the fixes use more information than one image"),
                    Not(HasSubstr("nothing beats"))));
  limited.crlb_ratio->horizontal = 0.9;
  EXPECT_EQ(warn_about_crlb(limited), "");
}

TEST(WarnAboutSampleSize, WarnsForFewerThanTwentyReferencePointsInComparison) {
  Evaluation compared = evaluation(1000);
  compared.comparison = Comparison{};
  compared.comparison->quantities[0].clusters = 8;
  EXPECT_THAT(warn_about_sample_size(compared),
              ElementsAre("with only 8 reference points with a fix in both files the comparison is "
                          "inconclusive; it needs 20"));
  compared.comparison->quantities[0].clusters = 20;
  EXPECT_THAT(warn_about_sample_size(compared), IsEmpty());
}

}  // namespace
}  // namespace vlp
