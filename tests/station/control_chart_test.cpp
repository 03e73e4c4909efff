// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/control_chart.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ControlChart, HasLimitsFromTheMovingRange) {
  // Moving ranges 2, 1, 3: mean 2; mean 2.5.
  const ControlChart chart = control_chart(std::vector<double>{1, 3, 2, 5});
  const double range = (2 + 1 + 3) / 3.0, mean = 11 / 4.0;
  EXPECT_DOUBLE_EQ(chart.mean, mean);
  EXPECT_DOUBLE_EQ(chart.upper, mean + 2.66 * range);
  EXPECT_DOUBLE_EQ(chart.lower, mean - 2.66 * range);
  EXPECT_THAT(chart.outside, IsEmpty());
}

TEST(ControlChart, NamesWhatIsOutside) {
  std::vector<double> values;
  for (int i = 0; i < 20; ++i) values.push_back(i % 2 == 0 ? 1.0 : 1.1);
  values[13] = 3;
  EXPECT_THAT(control_chart(values).outside, ElementsAre(13));
}

TEST(ControlChart, NamesADriftBeforeItIsOutside) {
  std::vector<double> values;
  for (int i = 0; i < 24; ++i) values.push_back((i % 2 == 0 ? 1.0 : 1.1) + (i < 12 ? 0 : 0.08));
  const ControlChart chart = control_chart(values);
  EXPECT_THAT(chart.outside, IsEmpty());
  EXPECT_THAT(chart.drifting, IsEmpty());
  for (int i = 12; i < 24; ++i) values[static_cast<std::size_t>(i)] += 0.1;
  EXPECT_THAT(control_chart(values).outside, IsEmpty());
  // Of the first twelve values the eighth and on are the eighth in a row below the mean, too.
  EXPECT_THAT(control_chart(values).drifting, ElementsAre(7, 8, 9, 10, 11, 19, 20, 21, 22, 23));
}

TEST(ControlChart, OfEqualValuesHasNoAlarm) {
  for (const double value : {1.0, 0.1, 0.3, 1e-7}) {
    const ControlChart chart = control_chart(std::vector<double>(10, value));
    EXPECT_EQ(chart.mean, value);
    EXPECT_THAT(chart.outside, IsEmpty());
    EXPECT_THAT(chart.drifting, IsEmpty());
  }
}

TEST(ControlChart, CountsAValueAtTheMeanOnNeitherSide) {
  // Mean 1: seven below it, one at it, seven above.
  std::vector<double> values(7, 0.5);
  values.push_back(1);
  values.insert(values.end(), 7, 1.5);
  EXPECT_EQ(control_chart(values).mean, 1);
  EXPECT_THAT(control_chart(values).drifting, IsEmpty());
}

TEST(ControlChart, DrawsAPicture) {
  const TemporaryFolder folder;
  std::vector<TrendPoint> points;
  for (int i = 0; i < 10; ++i)
    points.push_back({"run", "station", "camera", "PASS", i == 5 ? 9.0 : 1.0});
  draw_trend(folder / "trend.svg", "rms_px", points);
  const std::string svg = TemporaryFolder::content_of(folder / "trend.svg");
  EXPECT_THAT(svg, testing::HasSubstr("outside the limits"));
  EXPECT_THAT(svg, testing::HasSubstr("rms_px"));
}

}  // namespace
}  // namespace vlp
