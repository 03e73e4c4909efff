// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/bootstrap.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "support/random.h"

namespace vlp {
namespace {

struct Errors {
  std::vector<double> values;
  std::vector<std::size_t> clusters;
};

/// Draws horizontal errors: x and y each have a bias per reference point and independent noise,
/// both normal.
Errors draw(std::size_t stations, std::size_t captures, double bias, double scatter,
            Random& random) {
  Errors errors;
  for (std::size_t station = 0; station < stations; ++station) {
    const double x = bias * random.normal(), y = bias * random.normal();
    for (std::size_t i = 0; i < captures; ++i) {
      errors.values.push_back(
          std::hypot(x + scatter * random.normal(), y + scatter * random.normal()));
      errors.clusters.push_back(station);
    }
  }
  return errors;
}

/// Returns in how many cases the intervals of mean, median, p90 and rms contain the true value of a
/// Rayleigh distribution with this sigma.
std::array<int, 4> count_covered(std::size_t stations, std::size_t captures, double bias,
                                 double scatter, int cases = 300) {
  const double sigma = std::hypot(bias, scatter);
  const double mean = sigma * std::sqrt(std::numbers::pi / 2);
  const double median = sigma * std::sqrt(2 * std::log(2)),
               p90 = sigma * std::sqrt(2 * std::log(10));
  const double rms = sigma * std::sqrt(2);
  std::array<int, 4> counts{};
  Random random(1);
  for (int i = 0; i < cases; ++i) {
    const Errors errors = draw(stations, captures, bias, scatter, random);
    const ErrorIntervals intervals = bootstrap_intervals(errors.values, errors.clusters, 1).value();
    const auto holds = [](const Interval& interval, double truth) {
      return interval.low <= truth && truth <= interval.high ? 1 : 0;
    };
    counts[0] += holds(intervals.mean, mean);
    counts[1] += holds(intervals.median, median);
    if (intervals.p90) counts[2] += holds(*intervals.p90, p90);
    counts[3] += holds(intervals.rms, rms);
  }
  return counts;
}

/// The expectation of 95 % of 300 cases is 285 with a standard deviation of 4.
TEST(BootstrapIntervals, CoversTrueStatisticsAtNominalRate) {
  for (const int count : count_covered(100, 1, 0, 1)) {
    EXPECT_GE(count, 270);
    EXPECT_LE(count, 297);
  }
}

TEST(BootstrapIntervals, CoversTrueStatisticsAtNominalRateWithBiasPerCluster) {
  for (const int count : count_covered(100, 3, 1, 0.3)) {
    EXPECT_GE(count, 270);
    EXPECT_LE(count, 297);
  }
}

/// Percentile intervals of the rms cover 77, 85 and 90 %. The standard deviation is 0.5 %.
TEST(BootstrapIntervals, CoversMeanAndRmsOfFewClusters) {
  constexpr int cases = 2000;
  for (const std::size_t clusters : std::vector<std::size_t>{5, 10, 20}) {
    const auto [mean, median, p90, rms] = count_covered(clusters, 1, 0, 1, cases);
    for (const int count : {mean, rms}) {
      EXPECT_GE(count, (clusters < 10 ? 0.91 : 0.93) * cases) << clusters;
      EXPECT_LE(count, 0.97 * cases) << clusters;
    }
  }
}

TEST(BootstrapIntervals, RemainsFiniteIfMostErrorsAreEqual) {
  const std::vector<double> errors{0, 0, 0, 0, 1};
  const auto intervals = bootstrap_intervals(errors, std::vector<std::size_t>{0, 1, 2, 3, 4}, 1);
  ASSERT_TRUE(intervals);
  EXPECT_EQ(intervals->mean.low, 0);
  EXPECT_GE(intervals->mean.high, 0.2);
  EXPECT_LE(intervals->rms.high, 3);
}

/// Resampling single captures ignores their common bias, which is why clusters are resampled.
TEST(BootstrapIntervals, IsNarrowerWhenBiasedCapturesAreResampledSingly) {
  Random random(2);
  Errors errors = draw(40, 12, 1, 0.1, random);
  const Interval together = bootstrap_intervals(errors.values, errors.clusters, 1).value().mean;
  std::iota(errors.clusters.begin(), errors.clusters.end(), std::size_t{0});
  const Interval singly = bootstrap_intervals(errors.values, errors.clusters, 1).value().mean;
  EXPECT_LT(2 * (singly.high - singly.low), together.high - together.low);
}

/// Theoretical widths for many errors: 2 x 1.96 sd of the mean, and for quantiles sqrt(q (1 - q) /
/// n) / density. Percentiles of 2,000 resamples of 1,000 groups are accurate to some 5 %.
TEST(BootstrapIntervals, WidthMatchesTheoryForManyErrors) {
  Random random(3);
  const std::size_t count = 50000;
  const Errors errors = draw(count, 1, 0, 1, random);
  const auto intervals = bootstrap_intervals(errors.values, errors.clusters, 2);
  ASSERT_TRUE(intervals);
  EXPECT_EQ(intervals->clusters, count);
  const double root = std::sqrt(static_cast<double>(count));
  const auto expect_width = [&](const Interval& interval, double sd) {
    EXPECT_NEAR((interval.high - interval.low) / (2 * 1.96 * sd), 1, 0.15);
  };
  expect_width(intervals->mean, std::sqrt(2 - std::numbers::pi / 2) / root);
  const auto quantile_sd = [&](double q) {
    const double at = std::sqrt(-2 * std::log(1 - q)), density = at * (1 - q);
    return std::sqrt(q * (1 - q)) / density / root;
  };
  expect_width(intervals->median, quantile_sd(0.5));
  expect_width(intervals->p90.value(), quantile_sd(0.9));
}

TEST(BootstrapIntervals, ReturnsIdenticalIntervalsForAnyThreadCount) {
  Random random(4);
  const Errors errors = draw(3000, 2, 1, 1, random);
  const auto one = bootstrap_intervals(errors.values, errors.clusters, 1);
  const auto four = bootstrap_intervals(errors.values, errors.clusters, 4);
  ASSERT_TRUE(one && four);
  ASSERT_TRUE(one->p90 && four->p90);
  for (const auto figure : {&ErrorIntervals::mean, &ErrorIntervals::median, &ErrorIntervals::rms}) {
    EXPECT_EQ(((*one).*figure).low, ((*four).*figure).low);
    EXPECT_EQ(((*one).*figure).high, ((*four).*figure).high);
  }
  EXPECT_EQ(one->p90->low, four->p90->low);
  EXPECT_EQ(one->p90->high, four->p90->high);
}

TEST(BootstrapIntervals, ReturnsNulloptForFewerThanFiveClusters) {
  const std::vector<double> errors{1, 2, 3, 4, 5, 6};
  EXPECT_FALSE(bootstrap_intervals(errors, std::vector<std::size_t>{0, 0, 1, 1, 2, 3}, 1));
  const auto intervals = bootstrap_intervals(errors, std::vector<std::size_t>{0, 0, 1, 4, 2, 3}, 1);
  ASSERT_TRUE(intervals);
  EXPECT_EQ(intervals->clusters, 5);
}

TEST(BootstrapIntervals, OmitsP90ForTooFewClusters) {
  Random random(5);
  const Errors few = draw(kMinClustersForP90 - 1, 3, 1, 1, random);
  EXPECT_FALSE(bootstrap_intervals(few.values, few.clusters, 1).value().p90);
  const Errors sufficient = draw(kMinClustersForP90, 3, 1, 1, random);
  EXPECT_TRUE(bootstrap_intervals(sufficient.values, sufficient.clusters, 1).value().p90);
}

TEST(BootstrapIntervals, HasZeroWidthForEqualErrors) {
  const std::vector<double> errors(20, 2.5);
  std::vector<std::size_t> clusters(20);
  std::iota(clusters.begin(), clusters.end(), std::size_t{0});
  const auto intervals = bootstrap_intervals(errors, clusters, 1);
  ASSERT_TRUE(intervals && intervals->p90);
  EXPECT_EQ(intervals->median.low, 2.5);
  EXPECT_EQ(intervals->p90->high, 2.5);
  EXPECT_DOUBLE_EQ(intervals->mean.low, 2.5);
}

}  // namespace
}  // namespace vlp
