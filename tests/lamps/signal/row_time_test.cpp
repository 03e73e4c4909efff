// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/row_time.h"

#include <gmock/gmock.h>

#include <cmath>

#include "support/random.h"

namespace vlp {
namespace {

using testing::HasSubstr;

constexpr double kTrue_s = 2.1e-5;

LampMap make_lamp_map(const std::vector<double>& frequencies_hz) {
  LampMap map;
  for (const double frequency_hz : frequencies_hz) {
    const int id = static_cast<int>(map.lamps.size()) + 1;
    map.lamps.push_back({id, {double(id), 0, 2}, {}, frequency_hz, {}});
  }
  return map;
}

/// Adds `count` lights of a lamp, measured with this relative standard deviation.
void add(std::vector<MeasuredPeriod>& lights, double frequency_hz, int count, double sd,
         Random& random, std::optional<int> lamp = {}) {
  for (int i = 0; i < count; ++i) {
    lights.push_back({std::exp(sd * random.normal()) / (frequency_hz * kTrue_s), lamp});
  }
}

RowTimeResult find_row_time(const std::vector<MeasuredPeriod>& lights, const LampMap& map) {
  return select_row_time(list_row_time_candidates(lights, map));
}

const LampMap kMap = make_lamp_map({2000, 2500, 3000, 3500, 4000});

TEST(ListRowTimeCandidates, ReturnsExactRowTimeWithoutNoise) {
  Random random(1);
  std::vector<MeasuredPeriod> lights;
  for (const Lamp& lamp : kMap.lamps) add(lights, *lamp.frequency_hz, 1, 0, random);
  const auto result = find_row_time(lights, kMap);
  ASSERT_TRUE(result.row_time) << result.problem;
  EXPECT_NEAR(result.row_time->row_time_s, kTrue_s, 1e-12 * kTrue_s);
  EXPECT_EQ(result.row_time->lamps, 5);
  EXPECT_EQ(result.row_time->lights, 5);
}

TEST(ListRowTimeCandidates, IntervalOf95PercentCoversRowTimeForEachNumberOfLamps) {
  constexpr double frequency_sd = 0.005;
  constexpr int draws = 1000;
  for (const std::size_t count : {2U, 3U, 4U, 5U, 6U}) {
    Random random(2 + count);
    const std::vector<double> frequencies_hz{2000, 2500, 3010, 3500, 4020, 4600};
    const LampMap map =
        make_lamp_map({frequencies_hz.begin(), frequencies_hz.begin() + std::ptrdiff_t(count)});
    int covered = 0, found = 0;  // two lamps that differ by several sd have two row times
    for (int draw = 0; draw < draws; ++draw) {
      std::vector<MeasuredPeriod> lights;
      for (const Lamp& lamp : map.lamps) {
        add(lights, *lamp.frequency_hz * std::exp(frequency_sd * random.normal()), 20, 0.002,
            random, lamp.id);
      }
      const auto result = find_row_time(lights, map);
      if (!result.row_time) continue;
      ++found;
      const double error_s = std::abs(result.row_time->row_time_s - kTrue_s);
      covered += error_s < 1.96 * result.row_time->sd_s ? 1 : 0;
    }
    ASSERT_GT(found, 0.95 * draws) << count;
    EXPECT_GE(covered, 0.93 * found) << count;
    EXPECT_LE(covered, 0.97 * found) << count;
  }
}

TEST(ListRowTimeCandidates, RowTimeIsAccurateDespiteLightsMissingInMap) {
  Random random(3);
  std::vector<MeasuredPeriod> lights;
  for (const Lamp& lamp : kMap.lamps) add(lights, *lamp.frequency_hz, 20, 0.002, random);
  add(lights, 2700, 20, 0.002, random);  // a lamp that the map lacks
  for (int i = 0; i < 30; ++i) lights.push_back({random.uniform(5, 40), {}});
  const auto result = find_row_time(lights, kMap);
  ASSERT_TRUE(result.row_time) << result.problem;
  EXPECT_NEAR(result.row_time->row_time_s / kTrue_s, 1, 0.001);
  EXPECT_EQ(result.row_time->lamps, 5);
}

void expect_ambiguous(const std::vector<double>& seen_hz, const LampMap& map) {
  std::vector<MeasuredPeriod> lights;
  for (const double frequency_hz : seen_hz) lights.push_back({1 / (frequency_hz * kTrue_s), {}});
  const auto result = find_row_time(lights, map);
  EXPECT_FALSE(result.row_time);
  EXPECT_THAT(result.problem, HasSubstr("add captures with more lamps, or a table"));
}

TEST(SelectRowTime, ReturnsProblemWhenAmbiguous) {
  expect_ambiguous({2500}, kMap);
  // All ratios are equal, and one lamp is not detected.
  const LampMap even = make_lamp_map({1600, 2000, 2500, 3125});
  expect_ambiguous({1600, 2000, 2500}, even);
  expect_ambiguous({2000, 2500, 3125}, even);
}

/// Returns lights of these lamps of `map`, with their duties.
std::vector<MeasuredPeriod> with_duties(const LampMap& map,
                                        const std::vector<std::size_t>& lamp_indices) {
  std::vector<MeasuredPeriod> lights;
  for (const std::size_t i : lamp_indices) {
    const Lamp& lamp = map.lamps[i];
    lights.push_back({1 / (*lamp.frequency_hz * kTrue_s), {}, lamp.duty});
  }
  return lights;
}

TEST(ListRowTimeCandidates, ReturnsBothCandidatesWithTheirLampsWhenAmbiguous) {
  const LampMap even = make_lamp_map({1600, 2000, 2500, 3125});
  const auto result = list_row_time_candidates(with_duties(even, {1, 2, 3}), even);
  ASSERT_EQ(result.groups.size(), 3);
  ASSERT_EQ(result.candidates.size(), 2) << result.problem;
  EXPECT_LE(result.candidates[0].cost, result.candidates[1].cost);
  for (const RowTimeCandidate& candidate : result.candidates) {
    const double ratio = candidate.row_time.row_time_s / kTrue_s;
    const bool is_true = std::abs(ratio - 1) < 1e-9;
    EXPECT_TRUE(is_true || std::abs(ratio - 1.25) < 1e-9) << ratio;
    ASSERT_EQ(candidate.lamps.size(), 3);
    for (std::size_t i = 0; i < 3; ++i) {
      const double period_lines = std::exp(result.groups[i].log_period);
      ASSERT_EQ(candidate.lamps[i].size(), 1);
      const auto id = static_cast<std::size_t>(candidate.lamps[i][0]);
      EXPECT_NEAR(period_lines * candidate.row_time.row_time_s * *even.lamps[id - 1].frequency_hz,
                  1, 1e-9);
    }
  }
}

TEST(ListRowTimeCandidates, ResolvesAmbiguityByDifferentDutiesOfAllLamps) {
  LampMap even = make_lamp_map({1600, 2000, 2500, 3125});
  const std::vector duties{0.3, 0.7, 0.4, 0.7};
  for (std::size_t i = 0; i < 4; ++i) even.lamps[i].duty = duties[i];
  auto lights = with_duties(even, {1, 2, 3});
  // Blur and saturation may change duties by this amount.
  for (MeasuredPeriod& light : lights) *light.duty += 0.08;
  const auto result = find_row_time(lights, even);
  ASSERT_TRUE(result.row_time) << result.problem;
  EXPECT_NEAR(result.row_time->row_time_s, kTrue_s, 1e-9 * kTrue_s);
  // If one lamp has no duty, no duties are used.
  even.lamps[0].duty.reset();
  EXPECT_FALSE(find_row_time(lights, even).row_time);
  // Equal duties do not resolve the ambiguity.
  for (Lamp& lamp : even.lamps) lamp.duty = 0.5;
  EXPECT_FALSE(find_row_time(with_duties(even, {1, 2, 3}), even).row_time);
}

TEST(SelectRowTime, SelectsCandidateWithClearlyLowerPositionCost) {
  const LampMap even = make_lamp_map({1600, 2000, 2500, 3125});
  const auto found = list_row_time_candidates(with_duties(even, {1, 2, 3}), even);
  ASSERT_EQ(found.candidates.size(), 2);
  for (const std::size_t right : {0U, 1U}) {
    std::vector<double> costs{30, 30};
    costs[right] = 2;
    const auto result = select_row_time(found, costs);
    ASSERT_TRUE(result.row_time) << result.problem;
    EXPECT_EQ(result.row_time->row_time_s, found.candidates[right].row_time.row_time_s);
  }
  const auto undecided = select_row_time(found, std::vector<double>{2, 5});
  EXPECT_FALSE(undecided.row_time);
  EXPECT_THAT(undecided.problem, HasSubstr("fit a row time of"));
}

TEST(ListRowTimeCandidates, ResolvesAmbiguityByLabels) {
  const LampMap even = make_lamp_map({1600, 2000, 2500, 3125});
  const std::vector<MeasuredPeriod> lights{{1 / (2000 * kTrue_s), 2}, {1 / (2500 * kTrue_s), 3}};
  const auto result = find_row_time(lights, even);
  ASSERT_TRUE(result.row_time) << result.problem;
  EXPECT_NEAR(result.row_time->row_time_s, kTrue_s, 1e-12);
}

TEST(GroupLights, GroupsRepeatedPeriodsAndIgnoresSingleOnes) {
  Random random(4);
  std::vector<MeasuredPeriod> lights;
  add(lights, 2000, 40, 0.003, random);
  add(lights, 2500, 30, 0.003, random);
  for (int i = 0; i < 5; ++i) lights.push_back({random.uniform(30, 60), {}});
  const auto groups = group_lights(lights);
  ASSERT_EQ(groups.size(), 2);
  EXPECT_EQ(groups[0].lights.size(), 40);
  EXPECT_NEAR(std::exp(groups[0].log_period) * 2000 * kTrue_s, 1, 0.002);
  EXPECT_NEAR(groups[0].sd, 1.25 * 0.003 / std::sqrt(40), 3e-4);
  EXPECT_EQ(groups[1].lights.size(), 30);
}

}  // namespace
}  // namespace vlp
