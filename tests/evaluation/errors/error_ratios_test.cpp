// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/error_ratios.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "fix_at.h"
#include "support/random.h"

namespace vlp {
namespace {

TEST(NormalizeErrors, ReturnsOneIfErrorsMatchReportedSd) {
  Random random(1);
  std::vector<FixRow> fixes;
  std::vector<FixError> errors;
  for (std::size_t i = 0; i < 10000; ++i) {
    fixes.push_back(fix_at("", 0, 0));
    fixes.back().fix->sd = Eigen::Vector4d(1e-3, 2e-3, 3e-3, 0.1);
    errors.push_back({i,
                      {1e-3 * random.normal(), 2e-3 * random.normal()},
                      2 * 3e-3 * random.normal(),
                      {},
                      i,
                      0});
  }
  const auto ratio = normalize_errors(fixes, errors);
  ASSERT_TRUE(ratio);
  ASSERT_TRUE(ratio->height);
  EXPECT_NEAR(ratio->horizontal.rms, 1, 0.015);  // three standard errors
  EXPECT_NEAR(ratio->height->rms, 2, 0.05);      // stated too small by a factor of two
  EXPECT_NEAR(ratio->height->low, 2, 0.08);
  EXPECT_FALSE(ratio->yaw);
  EXPECT_NEAR(ratio->horizontal.within_95, 0.95, 0.006);
  EXPECT_NEAR(ratio->height->within_95, std::erf(kWithin95 / 2 / std::sqrt(2)), 0.015);
  fixes.resize(1);
  fixes[0].fix->sd.reset();
  EXPECT_FALSE(normalize_errors(fixes, {errors[0]}));
}

/// Returns the fractions of 2,000 units whose lower limit and whose rms exceed 1.2. Each has 36
/// fixes at 9 points in 4 directions, whose errors are `factor` times the reported sd. Half of
/// their variance is noise, the others are an error of the calibration, which rotates with the
/// camera, and of the map.
std::array<double, 2> fraction_above_gate(double factor, double calibration, double map) {
  Random random(5);
  constexpr int units = 2000;
  int low = 0, rms = 0;
  for (int unit = 0; unit < units; ++unit) {
    const Eigen::Vector2d of_camera{random.normal(), random.normal()},
        of_map{random.normal(), random.normal()};
    std::vector<FixRow> fixes;
    std::vector<FixError> errors;
    for (std::size_t i = 0; i < 36; ++i) {
      const double yaw_rad = static_cast<double>(i % 4) * std::numbers::pi / 2;
      fixes.push_back(fix_at("", 0, 0));
      fixes.back().fix->pose.yaw_rad = yaw_rad;
      fixes.back().fix->sd = Eigen::Vector4d::Ones();
      const Eigen::Vector2d noise{random.normal(), random.normal()};
      errors.push_back(
          {i,
           factor * (std::sqrt(1 - calibration - map) * noise +
                     std::sqrt(calibration) * (Eigen::Rotation2Dd(yaw_rad) * of_camera) +
                     std::sqrt(map) * of_map),
           {},
           {},
           i / 4,
           0});
    }
    const auto ratio = normalize_errors(fixes, errors);
    if (!ratio) return {1, 1};
    low += ratio->horizontal.low > 1.2 ? 1 : 0;
    rms += ratio->horizontal.rms > 1.2 ? 1 : 0;
  }
  return {low / double(units), rms / double(units)};
}

TEST(NormalizeErrors, FewCorrectUnitsExceedGateByLowerLimit) {
  for (const auto& [calibration, map] : {std::pair(0.0, 0.0), {0.5, 0.0}, {0.9, 0.0}, {0.4, 0.4}}) {
    const auto [low, rms] = fraction_above_gate(1, calibration, map);
    EXPECT_LE(low, 0.025) << calibration;
    if (calibration == 0.9) EXPECT_GE(rms, 0.2) << "the rms itself, as a gate";
  }
}

TEST(NormalizeErrors, MostUnitsWithUnderstatedNoiseExceedGateByLowerLimit) {
  EXPECT_GE(fraction_above_gate(2, 0, 0)[0], 0.95);
  EXPECT_GE(fraction_above_gate(4, 0.5, 0)[0], 0.8);
}

/// Four lamps round the origin at a height of 2 m.
LampMap four_lamps() {
  LampMap lamps;
  for (const auto& [x, y] : {std::pair(1.0, 1.0), {-1.0, 1.0}, {-1.0, -1.0}, {1.0, -1.0}}) {
    lamps.lamps.push_back({static_cast<int>(lamps.lamps.size()), {x, y, 2}, {}, {}, {}});
  }
  return lamps;
}

Camera pinhole() {
  return {
      "c", {1000, 1000}, *lens_model_from_name("LENSMODEL_PINHOLE"), {500, 500, 500, 500}, {}, {},
      {}};
}

/// Four lamps round the camera, 2 m above it, and a focal length of 500 px: sd(X) = sd(Y) =
/// (H / f) noise / sqrt(4), see ErrorBudget::noise.
TEST(ComputeCrlbRatio, MatchesClosedFormLimitForFourLamps) {
  const double sd_m = 2.0 / 500 * 0.1 / 2, limit_m = sd_m * std::sqrt(2);
  const std::vector<TruthRow> truth{
      {"a", {0, 0}, 0, 0.3}, {"b", {90, 0}, 0, 0}, {"c", {0, 0}, {}, 0}};
  const auto ratio = compute_crlb_ratio({{0, {0, 3 * limit_m}, {}, {}, 0, 0},
                                         {1, {5, 5}, {}, {}, 1, 1},   // sees no lamp
                                         {2, {5, 5}, {}, {}, 2, 2}},  // at an unknown height
                                        truth, four_lamps(), pinhole(), 0.1, 2);
  ASSERT_TRUE(ratio);
  EXPECT_EQ(ratio->fixes, 1);
  EXPECT_NEAR(ratio->crlb_m, limit_m, 1e-9);
  EXPECT_NEAR(ratio->horizontal, 3, 1e-6);
  EXPECT_NEAR(ratio->sd, 1 / std::sqrt(4.0), 1e-6);
}

TEST(CrlbRatio, AreErrorsBelowCrlbIsTrueOnlyForSignificantlySmallerErrors) {
  Random random(3);
  constexpr int trials = 2000, fixes = 50;
  const auto count_below_limit = [&](double stated) {
    int count = 0;
    for (int trial = 0; trial < trials; ++trial) {
      double squares = 0;
      for (int i = 0; i < 2 * fixes; ++i) squares += std::pow(random.normal(), 2);
      const double ratio = std::sqrt(squares / (2 * fixes)) / stated;
      count +=
          CrlbRatio{ratio, 1, fixes, 1 / std::sqrt(4.0 * fixes)}.are_errors_below_crlb() ? 1 : 0;
    }
    return count;
  };
  EXPECT_LE(count_below_limit(1), 10);  // 2.7 are expected
  EXPECT_EQ(count_below_limit(1.0 / 0.609), trials);
}

/// Every sixth camera is 10 m below the lamps, the others 2 m: their limit is five times as large,
/// and a few fixes make up most of the ratio.
TEST(CrlbRatio, AreErrorsBelowCrlbIsRarelyTrueByChanceForUnequalLimits) {
  Random random(4);
  constexpr int trials = 300;
  constexpr std::size_t fixes = 60;
  const LampMap lamps = four_lamps();
  const Camera camera = pinhole();
  constexpr double sd_per_m = 0.1 / 500 / 2;  // see above
  std::vector<TruthRow> truth;
  for (std::size_t i = 0; i < fixes; ++i) truth.push_back({"", {0, 0}, i % 6 == 0 ? -8.0 : 0, 0});
  int num_below_limit = 0, as_if_equal = 0;
  double square = 0, sd = 0;
  for (int trial = 0; trial < trials; ++trial) {
    std::vector<FixError> errors;
    for (std::size_t i = 0; i < fixes; ++i) {
      const double sd_m = sd_per_m * (2 - *truth[i].z_m);
      const double x_m = sd_m * random.normal(), y_m = sd_m * random.normal();
      errors.push_back({i, {x_m, y_m}, {}, {}, i, i});
    }
    const auto ratio = compute_crlb_ratio(errors, truth, lamps, camera, 0.1, 1);
    ASSERT_TRUE(ratio);
    sd = ratio->sd;
    square += std::pow(ratio->horizontal - 1, 2) / trials;
    num_below_limit += ratio->are_errors_below_crlb() ? 1 : 0;
    as_if_equal += ratio->horizontal < 1 - 3 / std::sqrt(4.0 * fixes) ? 1 : 0;
  }
  EXPECT_NEAR(std::sqrt(square) / sd, 1, 0.13);  // three standard errors
  EXPECT_LE(num_below_limit, 3);                 // 0.1 are expected
  EXPECT_GE(as_if_equal, 8);                     // 22 are expected: unequal limits matter here
}

}  // namespace
}  // namespace vlp
