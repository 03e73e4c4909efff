// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/stripes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/random.h"

namespace vlp {
namespace {

constexpr double kDarkCounts = 10, kBrightCounts = 200;

/// Returns the fraction of the time from `begin` to `begin` + `exposure`, in line times, during
/// which a square wave is on.
double lit_fraction(double begin, double exposure, double period, double duty) {
  const auto lit_until = [&](double time) {
    const double whole = std::floor(time / period);
    return whole * duty * period + std::min(time - whole * period, duty * period);
  };
  return (lit_until(begin + exposure) - lit_until(begin)) / exposure;
}

std::vector<double> square_wave(int lines, double period, double duty, double phase,
                                double exposure = 1) {
  std::vector<double> signal;
  for (int line = 0; line < lines; ++line) {
    const double fraction = lit_fraction(line + phase * period, exposure, period, duty);
    signal.push_back(kDarkCounts + (kBrightCounts - kDarkCounts) * fraction);
  }
  return signal;
}

/// Minimum number of periods: fewer have only one begin or end.
constexpr double kMinPeriods = 2.2;

class MeasureStripesOfSquareWave : public testing::TestWithParam<double> {};

TEST_P(MeasureStripesOfSquareWave, ReturnsPeriodAndDuty) {
  const double period = GetParam();
  for (const int lines : {40, 55, 70}) {
    if (lines < kMinPeriods * period) continue;
    for (const double duty : {0.3, 0.5, 0.7}) {
      for (const double phase : {0.0, 0.2, 0.4, 0.6, 0.8}) {
        SCOPED_TRACE(testing::Message() << lines << " lines, duty " << duty << ", phase " << phase);
        const Stripes stripes = measure_stripes(square_wave(lines, period, duty, phase));
        EXPECT_NEAR(stripes.period_lines, period, 0.01 * period);
        EXPECT_NEAR(stripes.duty, duty, 0.05);
        EXPECT_NEAR(stripes.contrast, 1 - kDarkCounts / kBrightCounts, 1e-9);
        EXPECT_NEAR(stripes.periods, lines / stripes.period_lines, 1e-9);
        EXPECT_GT(stripes.periodicity_r2, 0.5);
        EXPECT_LE(stripes.periodicity_r2, 1);
      }
    }
  }
}

TEST_P(MeasureStripesOfSquareWave, ReturnsPeriodWhenExposureBlursStripes) {
  const double period = GetParam();
  for (const int lines : {40, 55, 70}) {
    if (lines < kMinPeriods * period) continue;
    for (const double duty : {0.3, 0.5, 0.7}) {
      for (const double phase : {0.0, 0.2, 0.4, 0.6, 0.8}) {
        for (const double exposure : {0.15, 0.25}) {
          SCOPED_TRACE(testing::Message() << lines << " lines, duty " << duty << ", phase " << phase
                                          << ", exposure " << exposure);
          const Stripes stripes =
              measure_stripes(square_wave(lines, period, duty, phase, exposure * period));
          EXPECT_NEAR(stripes.period_lines, period, 0.01 * period);
          EXPECT_GT(stripes.periodicity_r2, 0.5);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Periods, MeasureStripesOfSquareWave,
                         testing::Values(5, 6.3, 8, 10.7, 13.3, 17.9, 25));

TEST(MeasureStripes, ReturnsPeriodAndPeriodicityOfSine) {
  for (const double period : {2.5, 4.0, 7.3, 20.0}) {
    std::vector<double> signal;
    for (int line = 0; line < 50; ++line) {
      signal.push_back(100 + 80 * std::sin(2 * std::numbers::pi * line / period));
    }
    const Stripes stripes = measure_stripes(signal);
    EXPECT_NEAR(stripes.period_lines, period, 0.01 * period);
    EXPECT_GT(stripes.periodicity_r2, 0.96);
  }
}

TEST(MeasureStripes, ReturnsPeriodAndDutyInNoise) {
  Random random(4);
  for (int draw = 0; draw < 100; ++draw) {
    std::vector<double> signal = square_wave(60, 9.3, 0.5, random.uniform(0, 1), 2);
    for (double& value : signal) value += 5 * random.normal();
    const Stripes stripes = measure_stripes(signal);
    EXPECT_NEAR(stripes.period_lines, 9.3, 0.02 * 9.3) << draw;
    EXPECT_NEAR(stripes.duty, 0.5, 0.08) << draw;
  }
}

TEST(MeasureStripes, ReturnsLowContrastAndPeriodicityForSteadyLight) {
  Random random(8);
  for (int draw = 0; draw < 100; ++draw) {
    std::vector<double> signal(60);
    for (double& value : signal) value = 150 + 2 * random.normal();
    const Stripes stripes = measure_stripes(signal);
    EXPECT_LT(stripes.contrast, 0.1);
    EXPECT_LT(stripes.periodicity_r2, 0.5);
  }
}

void expect_no_stripes(const std::vector<double>& signal) {
  const Stripes stripes = measure_stripes(signal);
  EXPECT_EQ(stripes.contrast, 0);
  EXPECT_EQ(stripes.periodicity_r2, 0);
  EXPECT_TRUE(std::isfinite(stripes.period_lines) && std::isfinite(stripes.periods));
  EXPECT_TRUE(stripes.duty >= 0 && stripes.duty <= 1) << stripes.duty;
}

TEST(MeasureStripes, ReturnsNoStripesForShortSignals) {
  for (int lines = 0; lines < 8; ++lines) expect_no_stripes(square_wave(lines, 4, 0.5, 0));
  EXPECT_GT(measure_stripes(square_wave(8, 4, 0.5, 0)).contrast, 0.5);
}

TEST(MeasureStripes, ReturnsNoStripesForConstantSignals) {
  for (const double level : {0.0, 1e-3, 0.1, 100.1, 200.0 / 3, -5.0}) {
    for (const std::size_t lines : {8U, 41U, 60U, 67U}) {
      SCOPED_TRACE(testing::Message() << level << ", " << lines);
      const Stripes stripes = measure_stripes(std::vector<double>(lines, level));
      EXPECT_EQ(stripes.contrast, 0);
      EXPECT_LT(stripes.periodicity_r2, 0.5);
      EXPECT_TRUE(stripes.duty >= 0 && stripes.duty <= 1) << stripes.duty;
    }
  }
}

TEST(MeasureStripes, ReturnsFiniteDutyForSignalWithOneOutlier) {
  // The darkest and brightest lines are excluded, and the others are constant.
  for (const double odd : {0.0, 300.0}) {
    std::vector<double> signal(60, 100);
    signal[20] = odd;
    const Stripes stripes = measure_stripes(signal);
    EXPECT_EQ(stripes.contrast, 0);
    EXPECT_TRUE(std::isfinite(stripes.duty));
  }
}

TEST(MeasureStripes, CountPerLineAveragesBeginsAndEndsOfStripes) {
  // 60 lines, lit from 5 to 9, 15 to 19 and so on: six begins, five or six ends.
  std::vector<double> signal(60, 0);
  for (std::size_t i = 0; i < signal.size(); ++i) signal[i] = i % 10 >= 5 ? 100 : 0;
  EXPECT_NEAR(measure_stripes(signal).count_per_line, 11.0 / 2 / 60, 1e-12);
}

TEST(MeasureStripes, LitAreaMatchesLitFractionOfDiscArea) {
  // The upper half is lit, then the half in the middle, where the chords are longer.
  std::vector<double> half(80, 0), middle(80, 0);
  for (std::size_t i = 0; i < 80; ++i) {
    half[i] = i < 40 ? 100 : 0;
    middle[i] = i >= 20 && i < 60 ? 100 : 0;
  }
  EXPECT_NEAR(measure_stripes(half).lit_area, 0.5, 1e-12);
  // Area of the chords sqrt(1 - y^2) for |y| < 0.45, divided by that for |y| < 0.9.
  const auto area = [](double y) { return y * std::sqrt(1 - y * y) + std::asin(y); };
  EXPECT_NEAR(measure_stripes(middle).lit_area, area(0.45) / area(0.9), 1e-3);
}

}  // namespace
}  // namespace vlp
