// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/row_time.h"

#include <gmock/gmock.h>

#include <cmath>

#include "lamps/signal/period_groups.h"
#include "support/random.h"

namespace vlp {
namespace {

using testing::HasSubstr;

constexpr double kTrue_s = 2.1e-5;

LampMap map_of(const std::vector<double>& frequencies_hz) {
  LampMap map;
  for (const double frequency_hz : frequencies_hz) {
    const int id = static_cast<int>(map.lamps.size()) + 1;
    map.lamps.push_back({id, {double(id), 0, 2}, {}, frequency_hz, {}});
  }
  return map;
}

/// `count` lights of a lamp, measured with that relative standard deviation.
void add(std::vector<MeasuredPeriod>& lights, double frequency_hz, int count, double sd,
         Random& random, std::optional<int> lamp = {}) {
  for (int i = 0; i < count; ++i) {
    lights.push_back({std::exp(sd * random.normal()) / (frequency_hz * kTrue_s), lamp});
  }
}

const LampMap kMap = map_of({2000, 2500, 3000, 3500, 4000});

TEST(RowTime, IsExactWithoutNoise) {
  Random random(1);
  std::vector<MeasuredPeriod> lights;
  for (const Lamp& lamp : kMap.lamps) add(lights, *lamp.frequency_hz, 1, 0, random);
  const auto result = estimate_row_time(lights, kMap);
  ASSERT_TRUE(result.found) << result.problem;
  EXPECT_NEAR(result.found->row_time_s, kTrue_s, 1e-12 * kTrue_s);
  EXPECT_EQ(result.found->lamps, 5);
  EXPECT_EQ(result.found->lights, 5);
}

TEST(RowTime, ScattersAsItSays) {
  Random random(2);
  double chi_square = 0;
  constexpr int draws = 300;
  for (int draw = 0; draw < draws; ++draw) {
    // Lamps are off their frequencies by 0.5 %.
    std::vector<MeasuredPeriod> lights;
    for (const Lamp& lamp : kMap.lamps) {
      add(lights, *lamp.frequency_hz * std::exp(0.005 * random.normal()), 20, 0.002, random);
    }
    const auto result = estimate_row_time(lights, kMap);
    ASSERT_TRUE(result.found) << result.problem;
    chi_square += std::pow((result.found->row_time_s - kTrue_s) / result.found->sd_s, 2);
  }
  // Of five lamps the scatter is known to a third: Student's t has a variance of 2.
  EXPECT_GT(chi_square / draws, 0.7);
  EXPECT_LT(chi_square / draws, 3);
}

TEST(RowTime, IsNotMisledByALampThatIsOff) {
  // As measured in a photograph of real lamps: the first is 4.4 % off.
  std::vector<MeasuredPeriod> lights;
  for (const double frequency_hz : {2089.0, 2511.0, 3006.0, 3533.0, 4014.0}) {
    lights.push_back({1 / (frequency_hz * kTrue_s), {}});
  }
  const auto result = estimate_row_time(lights, kMap);
  ASSERT_TRUE(result.found) << result.problem;
  EXPECT_NEAR(result.found->row_time_s / kTrue_s, 1, 0.006);
  EXPECT_LT(std::abs(result.found->row_time_s - kTrue_s), 3 * result.found->sd_s);
}

TEST(RowTime, IsNotMisledByOtherLights) {
  Random random(3);
  std::vector<MeasuredPeriod> lights;
  for (const Lamp& lamp : kMap.lamps) add(lights, *lamp.frequency_hz, 20, 0.002, random);
  add(lights, 2700, 20, 0.002, random);  // a lamp that the map lacks
  for (int i = 0; i < 30; ++i) lights.push_back({random.uniform(5, 40), {}});
  const auto result = estimate_row_time(lights, kMap);
  ASSERT_TRUE(result.found) << result.problem;
  EXPECT_NEAR(result.found->row_time_s / kTrue_s, 1, 0.001);
  EXPECT_EQ(result.found->lamps, 5);
}

TEST(RowTime, NeedsNoLabelsWhereThereIsOneFrequency) {
  const auto result = estimate_row_time(std::vector<MeasuredPeriod>{{1 / (2500 * kTrue_s), {}}},
                                        map_of({2500, 2500}));
  ASSERT_TRUE(result.found) << result.problem;
  EXPECT_NEAR(result.found->row_time_s, kTrue_s, 1e-12);
  EXPECT_EQ(result.found->lamps, 1);
}

void expect_ambiguous(const std::vector<double>& seen_hz, const LampMap& map) {
  std::vector<MeasuredPeriod> lights;
  for (const double frequency_hz : seen_hz) lights.push_back({1 / (frequency_hz * kTrue_s), {}});
  const auto result = estimate_row_time(lights, map);
  EXPECT_FALSE(result.found);
  EXPECT_THAT(result.problem, HasSubstr("add captures that show more lamps, or a table"));
}

TEST(RowTime, IsNotGuessed) {
  expect_ambiguous({2500}, kMap);
  // All ratios are equal, and one lamp is not seen.
  const LampMap even = map_of({1600, 2000, 2500, 3125});
  expect_ambiguous({1600, 2000, 2500}, even);
  expect_ambiguous({2000, 2500, 3125}, even);
}

TEST(RowTime, ComesFromLabelsWhereTheFrequenciesDoNotTell) {
  const LampMap even = map_of({1600, 2000, 2500, 3125});
  const std::vector<MeasuredPeriod> lights{{1 / (2000 * kTrue_s), 2}, {1 / (2500 * kTrue_s), 3}};
  const auto result = estimate_row_time(lights, even);
  ASSERT_TRUE(result.found) << result.problem;
  EXPECT_NEAR(result.found->row_time_s, kTrue_s, 1e-12);
}

TEST(RowTime, SaysWhyThereIsNone) {
  EXPECT_THAT(estimate_row_time({}, kMap).problem, HasSubstr("no light has clear stripes"));
  EXPECT_THAT(estimate_row_time(std::vector<MeasuredPeriod>{{10, 77}}, kMap).problem,
              HasSubstr("no lamp of the map"));
  // Periods of random lights.
  std::vector<MeasuredPeriod> lights;
  for (const double period : {5.0, 7.3, 11.9, 19.1, 30.7, 46.0}) lights.push_back({period, {}});
  const auto result = estimate_row_time(lights, map_of({2000, 2200}));
  EXPECT_FALSE(result.found);
  EXPECT_NE(result.problem, "");
}

TEST(PeriodGroups, AreOfOnePeriodEach) {
  Random random(4);
  std::vector<MeasuredPeriod> lights;
  add(lights, 2000, 40, 0.003, random);
  add(lights, 2500, 30, 0.003, random);
  for (int i = 0; i < 5; ++i) lights.push_back({random.uniform(30, 60), {}});
  const auto groups = period_groups(lights);
  ASSERT_EQ(groups.size(), 2);
  EXPECT_EQ(groups[0].lights, 40);
  EXPECT_NEAR(std::exp(groups[0].log_period) * 2000 * kTrue_s, 1, 0.002);
  EXPECT_NEAR(groups[0].sd, 1.25 * 0.003 / std::sqrt(40), 3e-4);
  EXPECT_EQ(groups[1].lights, 30);
}

}  // namespace
}  // namespace vlp
