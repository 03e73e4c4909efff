// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/capability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace vlp {
namespace {

/// NIST/SEMATECH e-Handbook of Statistical Methods, 6.1.6: limits 8 and 20, mean 16, s = 2.
TEST(ComputeCpkIndex, CpAndCpkMatchPublishedIndicesOfNist) {
  EXPECT_NEAR(compute_cp_index(20 - 8, 2, 49).value, 1.0, 1e-12);
  EXPECT_NEAR(compute_cpk_index({8, 20}, 16, 2, 49, 50).value, 0.6667, 5e-5);
  EXPECT_NEAR(compute_cpk_index({std::nullopt, 20}, 16, 2, 49, 50).value, 0.6667, 5e-5);
  EXPECT_NEAR(compute_cpk_index({8, std::nullopt}, 16, 2, 49, 50).value, 1.3333, 5e-5);
}

/// By hand: 1 / (9 * 100) + 1 / (2 * 450) = 1 / 450.
TEST(ComputeCpkIndex, IntervalMatchesBissellFormula) {
  const CapabilityIndex cpk = compute_cpk_index({std::nullopt, 3}, 0, 1, 450, 100);
  EXPECT_NEAR(cpk.value, 1, 1e-15);
  EXPECT_NEAR(cpk.high - cpk.value, 1.959964 / std::sqrt(450), 1e-7);
  EXPECT_NEAR(cpk.value - cpk.low, 1.959964 / std::sqrt(450), 1e-7);
}

TEST(ComputeCapability, DriftReducesPpkButNotCpk) {
  std::vector<double> values;
  for (int i = 0; i < 40; ++i) values.push_back((i % 2 == 0 ? 0.9 : 1.1) + 0.05 * i);
  const auto found = compute_capability(values, {std::nullopt, 5});
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->cp);
  EXPECT_NEAR(found->mean, 1 + 0.05 * 19.5, 1e-12);
  // Moving ranges 0.25 and 0.15, 20 and 19 times.
  EXPECT_NEAR(found->within_sd, (20 * 0.25 + 19 * 0.15) / 39 / 1.128, 1e-12);
  EXPECT_GT(found->cpk.value, 3 * found->ppk.value);
  const auto two = compute_capability(values, {-1, 5});
  ASSERT_TRUE(two->pp);
  EXPECT_NEAR(two->pp->value, 6 / (6 * two->overall_sd), 1e-12);
}

TEST(ComputeCapability, ReturnsNulloptForEqualValuesOrWithoutLimits) {
  EXPECT_FALSE(compute_capability(std::vector<double>{1}, {0, 2}));
  EXPECT_FALSE(compute_capability(std::vector<double>{1, 1, 1}, {0, 2}));
  EXPECT_FALSE(compute_capability(std::vector<double>{1, 2}, {}));
}

}  // namespace
}  // namespace vlp
