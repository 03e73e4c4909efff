// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/lamp_features.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lamps/signal/square_wave.h"

namespace vlp {
namespace {

TEST(ComputeLampFeatures, ReturnsFeaturesOfStripes) {
  Stripes stripes{};
  stripes.period_lines = 12;
  stripes.duty = 0.4;
  stripes.count_per_line = 0.08;
  stripes.lit_area = 0.45;
  EXPECT_EQ(compute_lamp_features(stripes), LampFeatures(std::log(12), 0.4, 0.08, 0.45));
  EXPECT_EQ(kLampFeatures[0], "log_period_lines");
}

TEST(ComputeLampFeatures, IsIndependentOfDistance) {
  Random random(7);
  for (const int lines : {60, 90, 120, 180}) {
    for (const double duty : {0.35, 0.6}) {
      LampFeatures mean = LampFeatures::Zero();
      constexpr int draws = 100;
      for (int draw = 0; draw < draws; ++draw) {
        mean += compute_lamp_features(
                    measure_stripes(noisy_square_wave(lines, 10.3, duty, 1, 0, random))) /
                draws;
      }
      EXPECT_NEAR(mean[0], std::log(10.3), 0.005);
      EXPECT_NEAR(mean[1], duty, 0.03);
      EXPECT_NEAR(mean[2], 1 / 10.3, 0.05 / 10.3);
      EXPECT_NEAR(mean[3], duty, 0.03);
    }
  }
}

TEST(MeasureStripes, CountsStripesInStepsOfHalf) {
  // 60 lines, lit from 5 to 9, 15 to 19 and so on: six begins, five or six ends.
  std::vector<double> signal(60, 0);
  for (std::size_t i = 0; i < signal.size(); ++i) signal[i] = i % 10 >= 5 ? 100 : 0;
  EXPECT_NEAR(measure_stripes(signal).count_per_line, 11.0 / 2 / 60, 1e-12);
}

TEST(MeasureStripes, ComputesLitAreaOfDisc) {
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
