// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/stripes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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

}  // namespace
}  // namespace vlp
