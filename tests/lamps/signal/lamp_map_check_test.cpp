// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/lamp_map_check.h"

#include <gmock/gmock.h>

#include "lamps/signal/frequency_identification.h"
#include "lamps/signal/square_wave.h"
#include "lamps/signal/stripes.h"

namespace vlp {
namespace {

constexpr StripeConditions kConditions{3e-5, 520, 0, 5e-5};

Lamp lamp(int id, double frequency_hz, std::optional<double> duty = 0.5) {
  return {id, {double(id), 0, 1.6}, make_disc_lamp_shape(0.18), frequency_hz, duty};
}

/// Returns the ratio of the RMS error of many measured periods to predict_period_sd().
double measured_over_stated(double period, double lines, double exposure_lines) {
  Random random(5);
  constexpr int draws = 300;
  double squares = 0;
  for (int draw = 0; draw < draws; ++draw) {
    const auto used = static_cast<int>(kUsedHeight * lines);
    const Stripes stripes =
        measure_stripes(noisy_square_wave(used, period, 0.5, exposure_lines, 0.02, random));
    squares += std::pow(stripes.period_lines / period - 1, 2);
  }
  return std::sqrt(squares / draws) / predict_period_sd(period, lines, exposure_lines);
}

TEST(PredictPeriodSd, CoversErrorsOfMeasuredPeriods) {
  for (const double lines : {40.0, 60.0, 100.0}) {
    for (const double period : {9.3, 20.8}) {
      for (const double exposure_lines : {0.02, 0.5, 1.0, 1.67, 4.0}) {
        SCOPED_TRACE(testing::Message()
                     << lines << " lines, period " << period << ", exposure " << exposure_lines);
        const double ratio = measured_over_stated(period, lines, exposure_lines);
        EXPECT_LT(ratio, 1.2);
        EXPECT_GT(ratio, 0.25);
      }
    }
  }
}

TEST(CountScanlines, ReturnsScanlinesOrNulloptForUnknownSizeOrLampBelowCamera) {
  EXPECT_NEAR(count_scanlines(lamp(1, 2000), kConditions).value(), 58.5, 1e-9);
  Lamp unknown = lamp(1, 2000);
  unknown.shape.size_m.reset();
  EXPECT_FALSE(count_scanlines(unknown, kConditions));
  StripeConditions above = kConditions;
  above.camera_height_m = 2;
  EXPECT_FALSE(count_scanlines(lamp(1, 2000), above));
}

TEST(ListAmbiguousLamps, ReturnsPairOfLampsWithNearlyEqualFrequencies) {
  const LampMap map{{lamp(1, 2000), lamp(2, 2500), lamp(3, 2530), lamp(4, 3100)}};
  const auto pairs = list_ambiguous_lamps(map, kConditions);
  ASSERT_EQ(pairs.size(), 1);
  EXPECT_EQ(pairs[0].first, 2);
  EXPECT_EQ(pairs[0].second, 3);
  EXPECT_NEAR(pairs[0].frequency_gap, 0.012, 1e-9);
  EXPECT_GT(pairs[0].required_gap, kLampDrift);
}

TEST(ListAmbiguousLamps, ReturnsNoneForEqualFrequenciesWithDifferentDuties) {
  EXPECT_TRUE(
      list_ambiguous_lamps({{lamp(2, 2500, 0.3), lamp(3, 2500, 0.7)}}, kConditions).empty());
  EXPECT_EQ(list_ambiguous_lamps({{lamp(2, 2500, 0.4), lamp(3, 2500, 0.6)}}, kConditions).size(),
            1);
  EXPECT_EQ(list_ambiguous_lamps({{lamp(2, 2500, 0.3), lamp(3, 2500, {})}}, kConditions).size(), 1);
}

TEST(ListAmbiguousLamps, RequiresLargerDifferenceForFewerLinesOrUnknownExposure) {
  const LampMap map{{lamp(1, 2500), lamp(2, 2560)}};
  EXPECT_TRUE(list_ambiguous_lamps(map, kConditions).empty());
  StripeConditions sharp = kConditions, far = kConditions;
  sharp.exposure_s.reset();
  EXPECT_EQ(list_ambiguous_lamps(map, sharp).size(), 1);
  far.camera_height_m = -1.5;
  EXPECT_EQ(list_ambiguous_lamps(map, far).size(), 1);
}

TEST(ExplainRoomChoice, NamesLampsSharingFrequencyAndAllRooms) {
  LampMapFile lamps{"lamps.yaml", {{lamp(1, 2000), lamp(2, 2500), lamp(7, 2010)}}, {"b", "b", "a"}};
  const std::string message = explain_room_choice(lamps, "--room");
  EXPECT_EQ(
      message,
      "lamps 1 and 7 share a frequency in two rooms: choose a room with --room; the map has: a, b");
  lamps.map.lamps[2].frequency_hz = 3000;
  EXPECT_EQ(explain_room_choice(lamps, "--room"), "");
}

TEST(ExplainRoomChoice, IsEmptyWhenChoosingRoomWouldNotHelp) {
  const LampMap map{{lamp(1, 2000), lamp(2, 2000)}};
  EXPECT_EQ(explain_room_choice({"lamps.yaml", map, {"hall", "hall"}}, "--room"), "");
  EXPECT_EQ(explain_room_choice({"lamps.yaml", map, {"", ""}}, "--room"), "");
  const LampMap duties{{lamp(1, 2000, 0.3), lamp(2, 2000, 0.7)}};
  EXPECT_EQ(explain_room_choice({"lamps.yaml", duties, {"hall", "office"}}, "--room"), "");
}

TEST(ExplainRoomChoice, ListsTenRoomsAtMost) {
  LampMapFile lamps;
  for (int i = 0; i < 12; ++i) {
    lamps.map.lamps.push_back(lamp(i, 2000));
    lamps.rooms.push_back("r" + std::to_string(10 + i));
  }
  EXPECT_THAT(explain_room_choice(lamps, "--room"), testing::EndsWith("r18, r19 and 2 more"));
}

/// Nearly all lamps just above the reported limit are identified.
TEST(ListAmbiguousLamps, ReportedNeededDifferenceSufficesForIdentification) {
  StripeConditions conditions = kConditions;
  conditions.exposure_s.reset();
  const auto pairs = list_ambiguous_lamps({{lamp(1, 2500), lamp(2, 2501)}}, conditions);
  ASSERT_EQ(pairs.size(), 1);
  const auto needed = pairs[0].required_gap;
  const LampMap map{{lamp(1, 2500), lamp(2, 2500 * (1 + needed))}};
  Random random(6);
  int right = 0, wrong = 0;
  for (int draw = 0; draw < 400; ++draw) {
    const double period = 1 / (2500 * conditions.row_time_s);
    const auto lines =
        static_cast<int>(kUsedHeight * count_scanlines(map.lamps[0], conditions).value());
    const auto id = identify_by_frequency(
        map, conditions.row_time_s,
        measure_stripes(noisy_square_wave(lines, period, 0.5, 0.02, 0.02, random)));
    right += id == 1;
    wrong += id == 2;
  }
  EXPECT_GE(right, 380);
  EXPECT_EQ(wrong, 0);
}

TEST(ListUnreadableLamps, ReturnsLampsWithTooFewPeriodsOrLowContrast) {
  const LampMap map{{lamp(1, 600), lamp(2, 2500), lamp(3, 19000)}};
  const auto unreadable = list_unreadable_lamps(map, kConditions);
  ASSERT_EQ(unreadable.size(), 2);
  EXPECT_EQ(unreadable[0].lamp, 1);
  EXPECT_LT(unreadable[0].periods, kMinPeriods);
  EXPECT_EQ(unreadable[1].lamp, 3);
  EXPECT_LT(unreadable[1].contrast, 0.2);
}

}  // namespace
}  // namespace vlp
