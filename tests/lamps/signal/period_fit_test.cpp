// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/period_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/random.h"

namespace vlp {
namespace {

/// A square wave of duty 0.5 behind a Gaussian envelope of the standard deviation `sigma_lines`.
LineProfile make_profile(double period_lines, double sigma_lines, double noise = 0,
                         std::uint64_t seed = 1) {
  constexpr double first_line = 40;
  Random random(seed);
  LineProfile profile{first_line, 1, {}};
  const int count = static_cast<int>(8 * sigma_lines);
  for (int i = 0; i < count; ++i) {
    const double line = first_line + i, away = (i - count / 2.0) / sigma_lines;
    const double phase = line / period_lines + 0.2;
    const bool is_lit = phase - std::floor(phase) < 0.5;
    const double level = 100 * std::exp(-away * away / 2) * (is_lit ? 1 : 0);
    profile.levels.push_back(std::max(0.0, level + noise * random.normal()));
  }
  return profile;
}

TEST(FitPeriodicSignal, ReturnsSmallUnexplainedFractionForSquareWaveWithEnvelope) {
  for (const double period : {9.0, 15.0, 26.5}) {
    const PeriodFit fit = fit_periodic_signal(make_profile(period, 2 * period), period);
    EXPECT_LT(fit.unexplained_fraction, 0.12) << period;
    EXPECT_NEAR(fit.depth, 4 / std::numbers::pi, 0.2) << period;
    EXPECT_GT(fit.periods, 4) << period;
  }
}

TEST(FitPeriodicSignal, ReturnsLargeUnexplainedFractionForOtherPeriod) {
  const LineProfile profile = make_profile(20, 40);
  EXPECT_GT(fit_periodic_signal(profile, 25).unexplained_fraction, 0.6);
  EXPECT_GT(fit_periodic_signal(profile, 16).unexplained_fraction, 0.6);
}

TEST(FitPeriodicSignal, ReturnsUnexplainedFractionOneWithoutSignal) {
  EXPECT_EQ(fit_periodic_signal({0, 1, {}}, 10).unexplained_fraction, 1);
  EXPECT_EQ(fit_periodic_signal({0, 1, std::vector<double>(50, 0)}, 10).unexplained_fraction, 1);
  EXPECT_EQ(fit_periodic_signal({0, 1, std::vector<double>(50, 3)}, 100).unexplained_fraction, 1)
      << "half a period";
}

TEST(FindBestFittingPeriod, ReturnsTruePeriodInNoise) {
  for (const double period : {9.0, 15.0, 26.5}) {
    const PeriodFit fit = find_best_fitting_period(make_profile(period, 2 * period, 5), 4);
    EXPECT_NEAR(fit.period_lines / period, 1, 0.01) << period;
    EXPECT_LT(fit.unexplained_fraction, 0.3) << period;
  }
}

TEST(FindBestFittingPeriod, ReturnsLargeUnexplainedFractionForPureNoise) {
  Random random(3);
  int explained = 0;
  for (int i = 0; i < 50; ++i) {
    LineProfile profile{0, 1, {}};
    for (int k = 0; k < 200; ++k) profile.levels.push_back(50 + 5 * random.normal());
    explained += find_best_fitting_period(profile, 4).unexplained_fraction < 0.45;
  }
  EXPECT_EQ(explained, 0);
}

TEST(DivideProfileByEnvelope, ReturnsStripesOfEqualHeight) {
  const auto signal = divide_profile_by_envelope(make_profile(15, 40), 15);
  ASSERT_GT(signal.size(), 100U);
  // Away from the ends the brightest lines are at 1 / duty.
  for (std::size_t i = signal.size() / 4; i < 3 * signal.size() / 4; ++i) {
    EXPECT_TRUE(signal[i] < 0.01 || std::abs(signal[i] - 2) < 0.3) << signal[i];
  }
}

}  // namespace
}  // namespace vlp
