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
  return compare_fix_errors(all.fixes, all.errors, all.others, all.other_errors, 1)
      .horizontal()
      .comparison_verdict();
}

TEST(CompareFixErrors, ReturnsBetterOrWorseForSmallPairedDifferences) {
  EXPECT_EQ(compare_pairs(pairs(100, 3e-4)), "worse");
  EXPECT_EQ(compare_pairs(pairs(100, -3e-4)), "better");
  EXPECT_EQ(compare_pairs(pairs(kMinClustersCompared, 1e-2)), "worse");
  EXPECT_EQ(compare_pairs(pairs(kMinClustersCompared - 1, 1e-2)), "inconclusive");  // too few
  EXPECT_EQ(compare_pairs(pairs(4, 1)), "inconclusive");
  const Pairs same = pairs(100, 0);
  EXPECT_EQ(
      compare_fix_errors(same.fixes, same.errors, same.fixes, same.errors, 1).comparison_verdict(),
      "equivalent");
}

TEST(CompareFixErrors, ReturnsEquivalentForDifferencesBelowOnePercent) {
  // For errors of 15 mm on average 1 % is 0.15 mm; the mean difference has an uncertainty of 0.01
  // mm.
  EXPECT_EQ(compare_pairs(pairs(100, 1e-4)), "equivalent");
  EXPECT_EQ(compare_pairs(pairs(100, -1e-4)), "equivalent");
  EXPECT_EQ(compare_pairs(pairs(100, 1.5e-4)), "inconclusive");
  const Pairs tenth = pairs(100, 1e-4);
  EXPECT_EQ(compare_fix_errors(tenth.fixes, tenth.errors, tenth.others, tenth.other_errors, 1)
                .horizontal()
                .describe_result(list_compared_quantities()[0]),
            "equivalent within 0.15 mm");
  // For small errors the smallest relevant difference is a micrometer.
  Pairs small = pairs(100, 0);
  for (FixError& error : small.errors) error.horizontal_m = {1e-5 + 1.7e-7, 0};
  for (FixError& error : small.other_errors) error.horizontal_m = {1e-5, 0};
  QuantityComparison comparison =
      compare_fix_errors(small.fixes, small.errors, small.others, small.other_errors, 1)
          .horizontal();
  const ComparedQuantity& horizontal = list_compared_quantities()[0];
  EXPECT_EQ(comparison.describe_result(horizontal), "equivalent within 0.001 mm");
  ASSERT_TRUE(comparison.interval);
  EXPECT_GT(comparison.interval->low, 0);
  comparison.min_relevant = 1e-7;
  EXPECT_EQ(comparison.describe_result(horizontal), "worse by more than 0.0001 mm");
  comparison.clusters = 1;
  EXPECT_EQ(comparison.describe_result(horizontal), "inconclusive, too few");
}

TEST(CompareFixErrors, ReturnsInconclusiveForFewClustersDespiteManyPairs) {
  Pairs all = pairs(100, 1e-2);
  for (FixError& error : all.errors) error.cluster = 3 * (error.cluster % 19);
  const QuantityComparison comparison =
      compare_fix_errors(all.fixes, all.errors, all.others, all.other_errors, 1).horizontal();
  EXPECT_EQ(comparison.clusters, 19);
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  ASSERT_TRUE(comparison.interval);
  EXPECT_GT(comparison.interval->low, 0);
}

TEST(QuantityComparison, VerdictRequiresWholeIntervalOnOneSideOfZero) {
  QuantityComparison comparison;
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.clusters = kMinClustersCompared;
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.interval = {-1, 0.1};
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.interval = {-0.1, 1};
  EXPECT_EQ(comparison.comparison_verdict(), "inconclusive");
  comparison.interval = {-1, -0.1};
  EXPECT_EQ(comparison.comparison_verdict(), "better");
  comparison.interval = {0.1, 1};
  EXPECT_EQ(comparison.comparison_verdict(), "worse");
}

TEST(CompareFixErrors, CountsPairsAndFixesMissingInEitherFile) {
  Pairs all = pairs(10, 1e-2);
  all.errors.erase(all.errors.begin(), all.errors.begin() + 3);
  all.other_errors.erase(all.other_errors.begin() + 9);
  const Comparison comparison =
      compare_fix_errors(all.fixes, all.errors, all.others, all.other_errors, 1);
  EXPECT_EQ(comparison.pairs, 6);
  EXPECT_EQ(comparison.horizontal().clusters, 6);
  EXPECT_EQ(comparison.horizontal().larger, 6);
  EXPECT_EQ(comparison.only_in_fixes, 1);
  EXPECT_EQ(comparison.only_in_other_fixes, 3);
  EXPECT_EQ(comparison.unpaired, 3) << "only in the others";
  EXPECT_NEAR(comparison.horizontal().mean_difference, 1e-2, 2e-4);
}

/// Returns the verdicts on the quantities if heights, yaw angles and standard deviations of the
/// first fixes differ from those of the others, and all other errors are equal.
std::vector<std::string_view> compare_changed(double height_m, double yaw_rad, double sd_ratio) {
  Pairs all = pairs(40, 0);
  all.others = all.fixes;
  all.other_errors = all.errors;
  Random random(2);
  for (std::size_t i = 0; i < all.errors.size(); ++i) {
    all.others[i].fix->sd = Eigen::Vector4d{0.01, 0.01, 0.01, 0.01};
    all.fixes[i].fix->sd = sd_ratio * *all.others[i].fix->sd;
    for (const auto part : {&FixError::height_m, &FixError::yaw_rad}) {
      all.other_errors[i].*part = 0.005 * random.normal();
      all.errors[i].*part =
          *(all.other_errors[i].*part) + (part == &FixError::yaw_rad ? yaw_rad : height_m);
    }
  }
  std::vector<std::string_view> verdicts;
  const Comparison comparison =
      compare_fix_errors(all.fixes, all.errors, all.others, all.other_errors, 1);
  for (const QuantityComparison& quantity : comparison.quantities)
    verdicts.push_back(quantity.comparison_verdict());
  verdicts.push_back(comparison.comparison_verdict());
  return verdicts;
}

TEST(CompareFixErrors, ReturnsWorseForHeightYawOrStandardDeviations) {
  using testing::ElementsAre;
  const char *same = "equivalent", *worse = "worse";
  const char* better = "better";
  EXPECT_THAT(compare_changed(0, 0, 1), ElementsAre(same, same, same, same, same, same));
  EXPECT_THAT(compare_changed(0.02, 0, 1), ElementsAre(same, worse, same, same, worse, worse));
  EXPECT_THAT(compare_changed(0, 0.02, 1), ElementsAre(same, same, worse, same, worse, worse));
  EXPECT_THAT(compare_changed(0, 0, 0.1), ElementsAre(same, same, same, better, worse, worse));
  EXPECT_THAT(compare_changed(0, 0, 10), ElementsAre(same, same, same, worse, better, worse));
}

TEST(CompareFixErrors, CountsUnpairedCaptures) {
  Pairs all = pairs(10, 0);
  const auto unpaired = [&] {
    return compare_fix_errors(all.fixes, all.errors, all.others, all.other_errors, 1).unpaired;
  };
  ASSERT_EQ(unpaired(), 0U);
  all.others.back().fix->sd = Eigen::Vector4d::Ones();
  EXPECT_EQ(unpaired(), 1U) << "without a standard deviation";
  std::swap(all.fixes.back().fix->sd, all.others.back().fix->sd);
  EXPECT_EQ(unpaired(), 1U) << "the others lack it";
  std::swap(all.fixes.back().fix->sd, all.others.back().fix->sd);
  all.others.pop_back();
  all.other_errors.erase(all.other_errors.begin());  // index of the last row
  EXPECT_EQ(unpaired(), 1U) << "no row";
  all.other_errors.pop_back();
  EXPECT_EQ(unpaired(), 1U) << "a fix where the others have none is no loss";
}

TEST(CheckSameImages, ThrowsNamingImageMissingInOtherFile) {
  const FileRows<FixRow> fixes{"a.csv", {fix_at("a", 0, 0)}};
  const FileRows<FixRow> others{"b.csv", {fix_at("a", 0, 0), fix_at("b", 0, 0)}};
  EXPECT_THAT(rejection_message([&] { check_same_images(fixes, others); }),
              HasSubstr("b.csv:1: image: 'b' is not in a.csv; 1 of 2"));
  EXPECT_EQ(rejection_message([&] { check_same_images(fixes, fixes); }), "");
}

}  // namespace
}  // namespace vlp
