// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/control_chart.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include "support/random.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::size_t> find_indices(const std::vector<ChartAlarm>& alarms) {
  std::vector<std::size_t> places;
  for (const ChartAlarm& alarm : alarms) places.push_back(alarm.index);
  return places;
}

bool matches(const std::string& name, const std::vector<double>& sigmas) {
  for (const ChartRule& rule : list_chart_rules()) {
    if (rule.name == name) return rule.matches(sigmas);
  }
  ADD_FAILURE() << "no rule " << name;
  return false;
}

/// Returns `count` equal values.
std::vector<double> times(std::size_t count, double value) {
  return std::vector<double>(count, value);
}
std::vector<double> in_turns(std::size_t count, double size) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(i % 2 == 0 ? size : -size);
  return values;
}
std::vector<double> with(std::vector<double> values, std::size_t place, double value) {
  values[place] = value;
  return values;
}

/// NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.2: flow rates of ten batches.
TEST(MakeControlChart, MatchesPublishedIndividualsChartOfNist) {
  const std::vector<double> flow{49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1};
  const ControlChart chart = make_control_chart(flow);
  constexpr double printed = 5e-5;
  EXPECT_NEAR(chart.mean, 50.81, printed);
  EXPECT_NEAR(chart.sigma * 1.128, 1.8778, printed);
  EXPECT_NEAR(chart.upper, 55.8041, printed);
  EXPECT_NEAR(chart.lower, 45.8159, printed);
  EXPECT_THAT(list_chart_alarms(flow, {"western-electric-1"}), IsEmpty());
}

/// NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.4.
TEST(ComputeEwma, MatchesPublishedAveragesAndLimitsOfNist) {
  const std::vector<double> values{52.0, 47.0, 53.0, 49.3, 50.1, 47.0, 51.0, 50.1, 51.2, 50.5,
                                   49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1};
  const Ewma average = compute_ewma(values, 50, 2.0539, 0.3);
  EXPECT_NEAR(average.upper, 52.5884, 5e-5);
  EXPECT_NEAR(average.lower, 47.4115, 1e-4);  // printed as 47.4115, cut off
  const std::vector<double> printed{50.60, 49.52, 50.56, 50.18, 50.16, 49.21, 49.75,
                                    49.85, 50.26, 50.33, 50.11, 49.36, 49.52, 50.05,
                                    49.38, 49.92, 50.73, 51.23, 51.94, 51.99};
  ASSERT_EQ(average.averages.size(), printed.size());
  for (std::size_t i = 0; i < printed.size(); ++i) {
    EXPECT_NEAR(average.averages[i], printed[i], 0.00501) << i;
  }
}

struct RuleCase {
  const char* rule;
  std::vector<double> matches, fails;
};

TEST(ListChartRules, RulesMatchOnlyTheirPatternEndingAtLastValue) {
  const std::vector<double> up{-0.4, -0.2, 0, 0.1, 0.2, 0.3};
  const std::vector<RuleCase> cases{
      {"western-electric-1", {3.01}, {3}},
      {"western-electric-1", {0, -3.01}, {-3.01, 0}},
      {"western-electric-2", {2.01, 0, 2.01}, {2.01, 0, -2.01}},
      {"western-electric-2", {-2.01, -2.01}, {2.01, 0, 0, 2.01}},
      {"western-electric-2", {0, 2.01, 2.01}, {2.01, 2.01, 0}},
      {"western-electric-3", {1.01, 1.01, -2, 1.01, 1.01}, {1.01, 1.01, 0, 0, 1.01, 1.01}},
      {"western-electric-3", times(4, -1.01), times(4, -1)},
      {"western-electric-4", times(8, 0.1), times(7, 0.1)},
      {"western-electric-4", times(8, -0.1), with(times(8, 0.1), 3, 0)},
      {"nelson-1", {-3.01}, {2.99}},
      {"nelson-2", times(9, -0.1), times(8, -0.1)},
      {"nelson-3", up, {up.begin() + 1, up.end()}},
      {"nelson-3", {up.rbegin(), up.rend()}, with(up, 3, 0)},
      {"nelson-4", in_turns(14, 0.5), in_turns(13, 0.5)},
      {"nelson-4", in_turns(14, -0.5), with(in_turns(14, 0.5), 6, -0.5)},
      {"nelson-5", {0, -2.01, -2.01}, {-2, -2.01, 0}},
      {"nelson-6", times(4, 1.01), times(3, 1.01)},
      {"nelson-7", in_turns(15, 0.99), in_turns(14, 0.99)},
      {"nelson-7", times(15, 0), with(times(15, 0), 14, 1)},
      {"nelson-8", in_turns(8, 1.01), in_turns(7, 1.01)},
      {"nelson-8", times(8, 1.01), with(in_turns(8, 1.01), 4, 1)},
  };
  for (const RuleCase& each : cases) {
    EXPECT_TRUE(matches(each.rule, each.matches))
        << each.rule << testing::PrintToString(each.matches);
    EXPECT_FALSE(matches(each.rule, each.fails)) << each.rule << testing::PrintToString(each.fails);
  }
}

TEST(ListChartAlarms, ReportsShiftOfMeanInsideLimits) {
  std::vector<double> values;
  for (int i = 0; i < 24; ++i) values.push_back((i % 2 == 0 ? 1.0 : 1.1) + (i < 12 ? 0 : 0.3));
  EXPECT_THAT(list_chart_alarms(values, {"western-electric-1"}), IsEmpty());
  // From the eighth on, the first twelve values are also eight in a row below the mean.
  EXPECT_THAT(find_indices(list_chart_alarms(values, {"western-electric-4"})),
              ElementsAre(7, 8, 9, 10, 11, 19, 20, 21, 22, 23));
  const auto by_average = list_chart_alarms(values, {"ewma"});
  ASSERT_FALSE(by_average.empty());
  EXPECT_EQ(by_average.back().index, 23u);
}

TEST(ListChartAlarms, AppliesAllRulesOfNamedSets) {
  const std::vector<double> values{0, 0.1, 0, 0.1, 0, 0.1, 0, 0.1, 5};
  std::vector<std::string> names;
  for (const ChartAlarm& alarm :
       list_chart_alarms(values, {"western-electric", "nelson-1", "ewma"})) {
    if (alarm.index == 8) names.push_back(alarm.rule);
  }
  EXPECT_THAT(names, ElementsAre("western-electric-1", "nelson-1", "ewma"));
  EXPECT_THAT(
      rejection_message<std::invalid_argument>([&] { list_chart_alarms(values, {"western"}); }),
      HasSubstr("there is no rule western; the rules are western-electric-1 to -4"));
}

TEST(ListChartAlarms, ReturnsNoneForEqualValues) {
  for (const double value : {1.0, 0.1, 0.3, 1e-7}) {
    const std::vector<double> values(20, value);  // more than any rule uses
    EXPECT_EQ(make_control_chart(values).mean, value);
    EXPECT_THAT(list_chart_alarms(values, {"western-electric", "nelson", "ewma"}), IsEmpty());
  }
}

TEST(ListChartAlarms, CountsValueAtMeanOnNeitherSide) {
  // Mean 1: seven below it, one at it, seven above.
  std::vector<double> values(7, 0.5);
  values.push_back(1);
  values.insert(values.end(), 7, 1.5);
  EXPECT_EQ(make_control_chart(values).mean, 1);
  EXPECT_THAT(list_chart_alarms(values, {"western-electric-4"}), IsEmpty());
}

/// Kinds of values without a change: normal, half-normal (absolute values), Rayleigh (lengths).
enum class Values { normal, half_normal, rayleigh };

double draw(Values kind, Random& random) {
  const double x = random.normal();
  if (kind == Values::normal) return x;
  return kind == Values::half_normal ? std::abs(x) : std::hypot(x, random.normal());
}

/// Of 400 processes the standard deviations are 1.4, 1.9 and 1.6 %. The whole history has an alarm
/// in 61, 87 and 74 % of the processes.
TEST(KeepRecentAlarms, FewUnchangedProcessesHaveAlarmsInLastEightOfHundredRuns) {
  const std::vector<std::pair<Values, double>> expected{
      {Values::normal, 8.8}, {Values::half_normal, 16.3}, {Values::rayleigh, 11.7}};
  for (const auto& [kind, percent] : expected) {
    Random random(1);
    int alarms = 0;
    for (int i = 0; i < 400; ++i) {
      std::vector<double> values;
      for (int run = 0; run < 100; ++run) values.push_back(draw(kind, random));
      const auto all = list_chart_alarms(values, {"western-electric"});
      if (!keep_recent_alarms(all, values.size(), 8).empty()) ++alarms;
    }
    EXPECT_NEAR(alarms / 4.0, percent, 5) << static_cast<int>(kind);
  }
}

TEST(KeepRecentAlarms, KeepsAlarmsOfWindowOnly) {
  const std::vector<ChartAlarm> alarms{{"nelson-1", "", 3}, {"nelson-2", "", 7}, {"ewma", "", 9}};
  EXPECT_THAT(find_indices(keep_recent_alarms(alarms, 10, 1)), ElementsAre(9));
  EXPECT_THAT(find_indices(keep_recent_alarms(alarms, 10, 3)), ElementsAre(7, 9));
  EXPECT_THAT(find_indices(keep_recent_alarms(alarms, 10, 100)), ElementsAre(3, 7, 9));
}

TEST(WriteTrendPlot, ShowsAlarmsAndGateOnlyIfGiven) {
  const TemporaryFolder folder;
  std::vector<TrendPoint> points;
  std::vector<double> values;
  for (int i = 0; i < 10; ++i) {
    values.push_back(i == 5 ? 9.0 : 1.0);
    points.push_back({"run", "station", "camera", "PASS", "2026-11-21T13:45:01Z", values.back()});
  }
  const std::vector<ChartAlarm> alarms{{"nelson-1", "far", 5}};
  write_trend_plot(folder / "trend.svg", "rms_px", points, alarms, 4.0);
  const std::string svg = TemporaryFolder::read_content(folder / "trend.svg");
  EXPECT_THAT(svg, testing::AllOf(HasSubstr("alarms"), HasSubstr("gate"), HasSubstr("rms_px")));
  write_trend_plot(folder / "plain.svg", "rms_px", points, {}, std::nullopt);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "plain.svg"),
              testing::Not(testing::AnyOf(HasSubstr("alarms"), HasSubstr("gate"))));
}

}  // namespace
}  // namespace vlp
