// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/frequency_identification.h"

#include <gtest/gtest.h>

namespace vlp {
namespace {

constexpr double kRowTime_s = 3e-5;

Lamp rule_lamp(int id, double frequency_hz, std::optional<double> duty = {}) {
  return {id, {double(id), 0, 2}, {}, frequency_hz, duty};
}

Stripes stripes(double frequency_hz, double duty = 0.5) {
  Stripes stripes{};
  stripes.contrast = stripes.periodicity_r2 = 0.9;
  stripes.period_lines = 1 / (frequency_hz * kRowTime_s);
  stripes.periods = 5;
  stripes.is_regular = true;
  stripes.duty = duty;
  return stripes;
}

std::optional<int> identified(const std::vector<Lamp>& lamps, const Stripes& stripes) {
  return identify_by_frequency({lamps}, kRowTime_s, stripes);
}

TEST(IdentifyByFrequency, ReturnsLampOnlyWithinToleranceOfItsFrequency) {
  const std::vector<Lamp> lamps{rule_lamp(1, 2000), rule_lamp(2, 2500)};
  EXPECT_EQ(identified(lamps, stripes(2000)), 1);
  EXPECT_EQ(identified(lamps, stripes(2080)), 1);
  EXPECT_EQ(identified(lamps, stripes(2400)), 2);
  EXPECT_EQ(identified(lamps, stripes(2240)), std::nullopt) << "between the two";
  EXPECT_EQ(identified(lamps, stripes(3000)), std::nullopt) << "like neither";
}

TEST(IdentifyByFrequency, AllowsLessDeviationForFewOrUnclearStripes) {
  const std::vector<Lamp> lamps{rule_lamp(1, 2000)};
  Stripes few = stripes(2080), unclear = few;
  few.periods = 2;
  unclear.periodicity_r2 = 0.6;
  EXPECT_EQ(identified(lamps, few), std::nullopt);
  EXPECT_EQ(identified(lamps, unclear), std::nullopt);
  few.period_lines = stripes(2030).period_lines;
  EXPECT_EQ(identified(lamps, few), 1);
}

TEST(IdentifyByFrequency, ReturnsNulloptForUnclearIrregularStripes) {
  const std::vector<Lamp> lamps{rule_lamp(1, 2000)};
  Stripes unclear = stripes(2000);
  unclear.periodicity_r2 = 0.6;
  unclear.is_regular = false;
  EXPECT_EQ(identified(lamps, unclear), std::nullopt);
  unclear.periodicity_r2 = 0.75;
  EXPECT_EQ(identified(lamps, unclear), 1);
}

TEST(IdentifyByFrequency, SeparatesLampsOfEqualFrequencyByDuty) {
  const std::vector<Lamp> lamps{rule_lamp(1, 2000, 0.3), rule_lamp(2, 2010, 0.7)};
  EXPECT_EQ(identified(lamps, stripes(2005, 0.33)), 1);
  EXPECT_EQ(identified(lamps, stripes(2005, 0.64)), 2);
  EXPECT_EQ(identified(lamps, stripes(2005, 0.5)), std::nullopt);
  EXPECT_EQ(identified({rule_lamp(1, 2000, 0.3), rule_lamp(2, 2010)}, stripes(2000, 0.3)),
            std::nullopt)
      << "the other's duty is not known";
}

TEST(IdentifyByFrequency, ReturnsLampByFrequencyEvenIfDutyContradicts) {
  const std::vector<Lamp> lamps{rule_lamp(1, 2000, 0.3), rule_lamp(2, 2500, 0.7)};
  EXPECT_EQ(identified(lamps, stripes(2000, 0.7)), 1);
}

TEST(IdentifyByFrequency, ReturnsNulloptWithoutPeriodOrFrequency) {
  EXPECT_EQ(identified({rule_lamp(1, 2000)}, Stripes{}), std::nullopt);
  EXPECT_EQ(identified({{1, {0, 0, 2}, {}, {}, {}}}, stripes(2000)), std::nullopt);
}

}  // namespace
}  // namespace vlp
