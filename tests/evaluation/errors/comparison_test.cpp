// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/comparison.h"

#include <gmock/gmock.h>

#include "fix_at.h"
#include "support/random.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::HasSubstr;

struct Pairs {
  std::vector<FixRow> fixes, others;
  std::vector<FixError> errors, other_errors;
};
/// Makes pairs of captures. The errors of the first run are larger by `difference_m` on average,
/// with noise.
Pairs pairs(std::size_t count, double difference_m) {
  Random random(1);
  Pairs all;
  for (std::size_t i = 0; i < count; ++i) {
    const double shared_m = random.uniform(0.01, 0.02);
    all.fixes.push_back(fix_at(std::to_string(i), 0, 0));
    all.others.push_back(fix_at(std::to_string(count - 1 - i), 0, 0));  // in another order
    all.errors.push_back({i, {shared_m + difference_m + 1e-4 * random.normal(), 0}, {}, {}, i});
    all.other_errors.push_back({count - 1 - i, {0, shared_m}, {}, {}, 0});
  }
  return all;
}
std::string_view compare_pairs(const Pairs& all) {
  return compare_horizontal_errors(all.fixes, all.errors, all.others, all.other_errors, 1)
      .comparison_verdict();
}

TEST(CompareHorizontalErrors, ReturnsBetterOrWorseForSmallPairedDifferences) {
  EXPECT_EQ(compare_pairs(pairs(100, 3e-4)), "worse");
  EXPECT_EQ(compare_pairs(pairs(100, -3e-4)), "better");
  EXPECT_EQ(compare_pairs(pairs(kMinClustersCompared, 1e-2)), "worse");
  EXPECT_EQ(compare_pairs(pairs(kMinClustersCompared - 1, 1e-2)), "inconclusive");  // too few
  EXPECT_EQ(compare_pairs(pairs(4, 1)), "inconclusive");
  const Pairs same = pairs(100, 0);
  EXPECT_EQ(compare_horizontal_errors(same.fixes, same.errors, same.fixes, same.errors, 1)
                .comparison_verdict(),
            "equivalent");
}

TEST(CompareHorizontalErrors, ReturnsEquivalentForDifferencesBelowOnePercent) {
  // For errors of 15 mm on average 1 % is 0.15 mm; the mean difference has an uncertainty of 0.01
  // mm.
  EXPECT_EQ(compare_pairs(pairs(100, 1e-4)), "equivalent");
  EXPECT_EQ(compare_pairs(pairs(100, -1e-4)), "equivalent");
  EXPECT_EQ(compare_pairs(pairs(100, 1.5e-4)), "inconclusive");
  const Pairs tenth = pairs(100, 1e-4);
  EXPECT_EQ(
      compare_horizontal_errors(tenth.fixes, tenth.errors, tenth.others, tenth.other_errors, 1)
          .describe_comparison_result(),
      "equivalent within 0.15 mm");
  // For small errors the smallest relevant difference is a micrometer.
  Pairs small = pairs(100, 0);
  for (FixError& error : small.errors) error.horizontal_m = {1e-5 + 1.7e-7, 0};
  for (FixError& error : small.other_errors) error.horizontal_m = {1e-5, 0};
  Comparison comparison =
      compare_horizontal_errors(small.fixes, small.errors, small.others, small.other_errors, 1);
  EXPECT_EQ(comparison.describe_comparison_result(), "equivalent within 0.001 mm");
  ASSERT_TRUE(comparison.interval_m);
  EXPECT_GT(comparison.interval_m->low, 0);
  comparison.min_relevant_m = 1e-7;
  EXPECT_EQ(comparison.describe_comparison_result(), "worse by more than 0.0001 mm");
  comparison.clusters = 1;
  EXPECT_EQ(comparison.describe_comparison_result(), "inconclusive, too few");
}

TEST(CompareHorizontalErrors, ReturnsInconclusiveForFewClustersDespiteManyPairs) {
  Pairs all = pairs(100, 1e-2);
  for (FixError& error : all.errors) error.cluster = 3 * (error.cluster % 19);
  const Comparison comparison =
      compare_horizontal_errors(all.fixes, all.errors, all.others, all.other_errors, 1);
  EXPECT_EQ(comparison.clusters, 19);
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  ASSERT_TRUE(comparison.interval_m);
  EXPECT_GT(comparison.interval_m->low, 0);
}

TEST(Comparison, VerdictRequiresWholeIntervalOnOneSideOfZero) {
  Comparison comparison;
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.clusters = kMinClustersCompared;
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.interval_m = {-1, 0.1};
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.interval_m = {-0.1, 1};
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.interval_m = {-1, -0.1};
  EXPECT_EQ(comparison.comparison_verdict(), "better");
  comparison.interval_m = {0.1, 1};
  EXPECT_EQ(comparison.comparison_verdict(), "worse");
}

TEST(CompareHorizontalErrors, CountsPairsAndFixesMissingInEitherRun) {
  Pairs all = pairs(10, 1e-2);
  all.errors.erase(all.errors.begin(), all.errors.begin() + 3);
  all.other_errors.erase(all.other_errors.begin() + 9);
  const Comparison comparison =
      compare_horizontal_errors(all.fixes, all.errors, all.others, all.other_errors, 1);
  EXPECT_EQ(comparison.pairs, 6);
  EXPECT_EQ(comparison.clusters, 6);
  EXPECT_EQ(comparison.larger, 6);
  EXPECT_EQ(comparison.only_in_fixes, 1);
  EXPECT_EQ(comparison.only_in_other_fixes, 3);
  EXPECT_NEAR(comparison.mean_difference_m, 1e-2, 2e-4);
}

TEST(CheckSameImagesInFixes, ThrowsNamingImageMissingInOtherFile) {
  const FileRows<FixRow> fixes{"a.csv", {fix_at("a", 0, 0)}};
  const FileRows<FixRow> others{"b.csv", {fix_at("a", 0, 0), fix_at("b", 0, 0)}};
  EXPECT_THAT(rejection_message([&] { check_same_images_in_fixes(fixes, others); }),
              HasSubstr("b.csv:1: image: 'b' is not in a.csv; 1 of 2"));
  EXPECT_EQ(rejection_message([&] { check_same_images_in_fixes(fixes, fixes); }), "");
}

}  // namespace
}  // namespace vlp
