// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/measurement_study.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/random.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// Values by unit, then station, then repeat.
std::vector<StudyValue> crossed(std::size_t stations, std::size_t repeats,
                                const std::vector<double>& values) {
  std::vector<StudyValue> all;
  for (std::size_t i = 0; i < values.size(); ++i) {
    all.push_back({std::to_string(100 + i / (stations * repeats)),
                   std::to_string(i / repeats % stations), values[i]});
  }
  return all;
}

/// Counts in how many of 300 studies the intervals of GRR, GRR / TV and ndc contain the true
/// figures.
std::array<int, 3> count_covered(std::size_t units, std::size_t stations, std::size_t repeats,
                                 double station_sd, double interaction_sd) {
  constexpr double unit_sd = 1, error_sd = 0.2;
  const double grr =
      std::sqrt(error_sd * error_sd + interaction_sd * interaction_sd + station_sd * station_sd);
  Random random(2);
  std::array<int, 3> counts{};
  for (int i = 0; i < 300; ++i) {
    std::vector<double> of_stations, values;
    for (std::size_t o = 0; o < stations; ++o) of_stations.push_back(station_sd * random.normal());
    for (std::size_t p = 0; p < units; ++p) {
      const double unit = unit_sd * random.normal();
      for (const double station : of_stations) {
        const double cell = unit + station + interaction_sd * random.normal();
        for (std::size_t r = 0; r < repeats; ++r)
          values.push_back(cell + error_sd * random.normal());
      }
    }
    const MeasurementStudy study = analyze_study(crossed(stations, repeats, values));
    const auto holds = [](const Interval& interval, double truth) {
      return interval.low <= truth && truth <= interval.high ? 1 : 0;
    };
    counts[0] += holds(study.grr_interval, grr);
    counts[1] += holds(study.grr_fraction_interval, grr / std::hypot(grr, unit_sd));
    counts[2] +=
        holds(study.categories_interval, MeasurementStudy::kCategoriesPerRatio * unit_sd / grr);
  }
  return counts;
}

/// The expectation of 95 % of 300 studies is 285 with a standard deviation of 4.
TEST(AnalyzeStudy, IntervalsCoverTrueFiguresAtNominalRate) {
  for (const auto& counts : {count_covered(10, 1, 3, 0, 0), count_covered(10, 3, 3, 0.1, 0),
                             count_covered(5, 2, 2, 0.2, 0), count_covered(10, 3, 2, 0.1, 0.3)}) {
    for (const int count : counts) {
      EXPECT_GE(count, 270);
      EXPECT_LE(count, 300);
    }
  }
}

/// AIAG, Measurement Systems Analysis, 4th ed., tables III-B 6 (values), A 3 (analysis of variance)
/// and A 4 (parts of the variation): 10 parts, 3 appraisers, 3 trials.
TEST(AnalyzeStudy, MatchesGaugeStudyOfAiagManual) {
  const MeasurementStudy study = analyze_study(
      crossed(3, 3, {0.29,  0.41,  0.64,  0.08,  0.25,  0.07,  0.04,  -0.11, -0.15,     // 1
                     -0.56, -0.68, -0.58, -0.47, -1.22, -0.68, -1.38, -1.13, -0.96,     // 2
                     1.34,  1.17,  1.27,  1.19,  0.94,  1.34,  0.88,  1.09,  0.67,      // 3
                     0.47,  0.50,  0.64,  0.01,  1.03,  0.20,  0.14,  0.20,  0.11,      // 4
                     -0.80, -0.92, -0.84, -0.56, -1.20, -1.28, -1.46, -1.07, -1.45,     // 5
                     0.02,  -0.11, -0.21, -0.20, 0.22,  0.06,  -0.29, -0.67, -0.49,     // 6
                     0.59,  0.75,  0.66,  0.47,  0.55,  0.83,  0.02,  0.01,  0.21,      // 7
                     -0.31, -0.20, -0.17, -0.63, 0.08,  -0.34, -0.46, -0.56, -0.49,     // 8
                     2.26,  1.99,  2.01,  1.80,  2.12,  2.19,  1.77,  1.45,  1.87,      // 9
                     -1.36, -1.25, -1.31, -1.68, -1.62, -1.50, -1.49, -1.77, -2.16}));  // 10
  constexpr double printed = 5e-5;
  EXPECT_NEAR(study.station.sum_of_squares, 3.1673, printed);
  EXPECT_NEAR(study.unit.sum_of_squares, 88.3619, printed);
  EXPECT_NEAR(study.interaction.sum_of_squares, 0.3590, printed);
  EXPECT_NEAR(study.error.sum_of_squares, 2.7589, printed);
  EXPECT_EQ(study.station.dof, 2);
  EXPECT_EQ(study.unit.dof, 9);
  EXPECT_EQ(study.interaction.dof, 18);
  EXPECT_EQ(study.error.dof, 60);
  EXPECT_NEAR(study.station.mean_square() / study.error.mean_square(), 34.44, 0.005);
  EXPECT_NEAR(study.unit.mean_square() / study.error.mean_square(), 213.52, 0.005);
  EXPECT_NEAR(study.interaction.mean_square() / study.error.mean_square(), 0.434, 5e-4);
  EXPECT_TRUE(study.pooled);
  constexpr double last_digit = 1.5e-6;  // the manual's own rounding on the way
  EXPECT_NEAR(study.repeatability, 0.199933, last_digit);
  EXPECT_NEAR(study.station_sd, 0.226838, last_digit);
  EXPECT_EQ(study.interaction_sd, 0);
  EXPECT_NEAR(study.grr, 0.302373, 2 * last_digit);
  EXPECT_NEAR(study.unit_sd, 1.042327, last_digit);
  EXPECT_NEAR(study.total, 1.085, 5e-4);
  EXPECT_NEAR(100 * study.grr / study.total, 27.9, 0.05);
  EXPECT_NEAR(100 * study.repeatability / study.total, 18.4, 0.05);
  EXPECT_NEAR(100 * study.station_sd / study.total, 20.9, 0.05);
  EXPECT_NEAR(100 * study.unit_sd / study.total, 96.0, 0.05);
  EXPECT_EQ(study.count_distinct_categories(), 4);
}

/// Values of the same equations in NumPy and SciPy, because none are published.
TEST(AnalyzeStudy, DoesNotPoolSignificantInteraction) {
  const MeasurementStudy study =
      analyze_study(crossed(2, 2, {10, 10.2, 12, 12.2, 11, 11.4, 10, 10.4, 15, 15.2, 14, 14.6}));
  EXPECT_FALSE(study.pooled);
  EXPECT_NEAR(*study.interaction_p, 0.0002923805372109052, 1e-12);
  EXPECT_NEAR(std::pow(study.repeatability, 2), 0.06666666666666661, 1e-12);
  EXPECT_NEAR(std::pow(study.interaction_sd, 2), 1.3733333333333282, 1e-12);
  EXPECT_EQ(study.station_sd, 0) << "-0.467 is none";
  EXPECT_NEAR(std::pow(study.unit_sd, 2), 4.150000000000005, 1e-12);
  EXPECT_NEAR(std::pow(study.grr, 2), 0.06666666666666661 + 1.3733333333333282, 1e-12);
}

/// By hand: two units at 0 and 10, each measured twice, 1 apart: MS_e = 0.5, MS_unit = 100.
TEST(AnalyzeStudy, ComputesRepeatabilityForOneStation) {
  const MeasurementStudy study = analyze_study(crossed(1, 2, {-0.5, 0.5, 9.5, 10.5}));
  EXPECT_EQ(study.stations, 1u);
  EXPECT_FALSE(study.interaction_p);
  EXPECT_DOUBLE_EQ(study.repeatability, std::sqrt(0.5));
  EXPECT_EQ(study.station_sd, 0);
  EXPECT_DOUBLE_EQ(study.unit_sd, std::sqrt((100 - 0.5) / 2));
  EXPECT_EQ(study.count_distinct_categories(), static_cast<int>(1.41 * std::sqrt(99.5)));
  const double sd = std::sqrt(0.5);
  EXPECT_FALSE(study.precision_to_tolerance_percent({}));
  EXPECT_DOUBLE_EQ(*study.precision_to_tolerance_percent({0, 20}), 100 * 6 * sd / 20);
  EXPECT_DOUBLE_EQ(*study.precision_to_tolerance_percent({std::nullopt, 11}), 100 * 3 * sd / 6);
  EXPECT_DOUBLE_EQ(*study.precision_to_tolerance_percent({1, std::nullopt}), 100 * 3 * sd / 4);
  // The mean, 5, is at the one limit or beyond it.
  EXPECT_FALSE(study.precision_to_tolerance_percent({std::nullopt, 5}));
  EXPECT_FALSE(study.precision_to_tolerance_percent({std::nullopt, 1}));
  EXPECT_FALSE(study.precision_to_tolerance_percent({5, std::nullopt}));
  EXPECT_FALSE(study.precision_to_tolerance_percent({11, std::nullopt}));
}

TEST(AnalyzeStudy, ThrowsForMissingOrUnbalancedValues) {
  EXPECT_THAT(rejection_message<std::invalid_argument>([] { analyze_study({}); }),
              HasSubstr("two units"));
  EXPECT_THAT(rejection_message<std::invalid_argument>([] {
                analyze_study(crossed(1, 1, {1, 2}));
              }),
              HasSubstr("two or more"));
  auto values = crossed(2, 2, {1, 2, 3, 4, 5, 6, 7, 8});
  values.pop_back();
  EXPECT_THAT(rejection_message<std::invalid_argument>([&] { analyze_study(values); }),
              HasSubstr("unit 101 has 1 runs on 1, 100 has 2 on 0"));
  values = crossed(2, 2, {1, 2, 3, 4, 5, 6, 7, 8});
  values.erase(values.begin(), values.begin() + 2);
  EXPECT_THAT(rejection_message<std::invalid_argument>([&] { analyze_study(values); }),
              HasSubstr("unit 100 has 0 runs on 0, 100 has 2 on 1"));
}

}  // namespace
}  // namespace vlp
