// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/control_chart.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "captures/number_text.h"
#include "report/plots/gnuplot.h"
#include "report/plots/plot_parts.h"

#include "station/statistics/distributions.h"

namespace vlp {

namespace {

using Sigmas = std::span<const double>;

/// Returns true if at least `many` of the last `of` values, including the last one, are more than
/// `away` sigmas from the mean on one side.
template <int many, int of, int away>
bool has_values_beyond(Sigmas sigmas) {
  if (sigmas.size() < many) return false;
  const Sigmas last = sigmas.last(std::min<std::size_t>(of, sigmas.size()));
  for (const double side : {1.0, -1.0}) {
    const auto is_beyond = [&](double value) { return side * value > away; };
    if (is_beyond(last.back()) && std::count_if(last.begin(), last.end(), is_beyond) >= many) {
      return true;
    }
  }
  return false;
}

/// Returns true if the last `many` values increase or decrease throughout; if `turns`, if they
/// alternate.
template <std::size_t many, bool turns>
bool has_steps(Sigmas sigmas) {
  if (sigmas.size() < many) return false;
  const Sigmas last = sigmas.last(many);
  for (const double first : {1.0, -1.0}) {
    bool all = true;
    double direction = first;
    for (std::size_t i = 1; i < many; ++i, direction *= turns ? -1 : 1) {
      all = all && direction * (last[i] - last[i - 1]) > 0;
    }
    if (all) return true;
  }
  return false;
}

/// Returns true if all of the last `many` values are nearer to the mean than one sigma, or all
/// farther.
template <std::size_t many, bool nearer>
bool are_near_or_far(Sigmas sigmas) {
  if (sigmas.size() < many) return false;
  const Sigmas last = sigmas.last(many);
  return std::all_of(last.begin(), last.end(), [](double value) {
    return nearer ? std::abs(value) < 1 : std::abs(value) > 1;
  });
}

constexpr const char *kBeyond3 = "more than 3 sigmas from the mean",
                     *kBeyond2 = "2 of 3 more than 2 sigmas from the mean, on one side",
                     *kBeyond1 = "4 of 5 more than a sigma from the mean, on one side";

constexpr std::array kRules{
    ChartRule{"western-electric-1", kBeyond3, has_values_beyond<1, 1, 3>},
    ChartRule{"western-electric-2", kBeyond2, has_values_beyond<2, 3, 2>},
    ChartRule{"western-electric-3", kBeyond1, has_values_beyond<4, 5, 1>},
    ChartRule{"western-electric-4", "8 in a row on one side of the mean",
              has_values_beyond<8, 8, 0>},
    ChartRule{"nelson-1", kBeyond3, has_values_beyond<1, 1, 3>},
    ChartRule{"nelson-2", "9 in a row on one side of the mean", has_values_beyond<9, 9, 0>},
    ChartRule{"nelson-3", "6 in a row up, or down", has_steps<6, false>},
    ChartRule{"nelson-4", "14 in a row alternating up and down", has_steps<14, true>},
    ChartRule{"nelson-5", kBeyond2, has_values_beyond<2, 3, 2>},
    ChartRule{"nelson-6", kBeyond1, has_values_beyond<4, 5, 1>},
    ChartRule{"nelson-7", "15 in a row within a sigma of the mean", are_near_or_far<15, true>},
    ChartRule{"nelson-8", "8 in a row more than a sigma from the mean", are_near_or_far<8, false>}};

constexpr const char* kEwma = "ewma";
constexpr double kEwmaWeight = 0.3;

bool is_selected_by(const std::string& rule, const std::string& name) {
  return rule == name || rule.substr(0, rule.rfind('-')) == name;
}

/// Throws for an unknown rule.
void check_rules(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const auto is_named = [&](const ChartRule& rule) { return is_selected_by(rule.name, name); };
    if (name == kEwma || std::ranges::any_of(kRules, is_named)) continue;
    throw std::invalid_argument("there is no rule " + name +
                                "; the rules are western-electric-1 to -4, nelson-1 to -8, ewma, "
                                "and western-electric and nelson for all of them");
  }
}

}  // namespace

ControlChart make_control_chart(std::span<const double> values) {
  constexpr double d2 = 1.128;
  ControlChart chart;
  if (values.empty()) return chart;
  const auto count = static_cast<double>(values.size());
  double ranges = 0;
  for (std::size_t i = 1; i < values.size(); ++i) ranges += std::abs(values[i] - values[i - 1]);
  chart.mean = compute_mean(values);
  chart.sigma = values.size() > 1 ? ranges / (count - 1) / d2 : 0;
  chart.lower = chart.mean - 3 * chart.sigma;
  chart.upper = chart.mean + 3 * chart.sigma;
  return chart;
}

std::span<const ChartRule> list_chart_rules() { return kRules; }

Ewma compute_ewma(std::span<const double> values, double target, double sigma, double weight,
                  double width) {
  const double half = width * sigma * std::sqrt(weight / (2 - weight));
  Ewma result{target - half, target + half, {}};
  result.averages.reserve(values.size());
  double average = target;
  for (const double value : values) {
    average += weight * (value - average);
    result.averages.push_back(average);
  }
  return result;
}

std::vector<ChartAlarm> list_chart_alarms(std::span<const double> values,
                                          const std::vector<std::string>& rules) {
  check_rules(rules);
  const ControlChart chart = make_control_chart(values);
  if (chart.sigma <= 0) return {};
  std::vector<double> sigmas;
  sigmas.reserve(values.size());
  for (const double value : values) sigmas.push_back((value - chart.mean) / chart.sigma);
  const Ewma average = compute_ewma(sigmas, 0, 1, kEwmaWeight);
  std::vector<ChartAlarm> alarms;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto is_selected = [&](const std::string& rule) {
      return std::ranges::any_of(
          rules, [&](const std::string& name) { return is_selected_by(rule, name); });
    };
    for (const ChartRule& rule : kRules) {
      if (is_selected(rule.name) && rule.matches(Sigmas(sigmas).first(i + 1))) {
        alarms.push_back({rule.name, rule.description, i});
      }
    }
    const bool is_outside =
        average.averages[i] < average.lower || average.averages[i] > average.upper;
    if (is_outside && is_selected(kEwma)) {
      alarms.push_back({kEwma, "the moving average is beyond its limits", i});
    }
  }
  return alarms;
}

std::vector<ChartAlarm> keep_recent_alarms(std::vector<ChartAlarm> alarms, std::size_t count,
                                           std::size_t window) {
  std::erase_if(alarms, [&](const ChartAlarm& alarm) { return alarm.index + window < count; });
  return alarms;
}

void write_trend_plot(const std::filesystem::path& file, const std::string& title,
                      std::span<const TrendPoint> points, std::span<const ChartAlarm> alarms,
                      std::optional<double> gate) {
  const std::vector<double> values = extract_trend_values(points);
  const ControlChart chart = make_control_chart(values);
  std::vector<bool> alarm(points.size());
  for (const ChartAlarm& each : alarms) alarm[each.index] = true;
  std::string data, alarm_points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string row = format_data_row({double(i + 1), values[i]});
    data += row;
    if (alarm[i]) alarm_points += row;
  }
  using namespace plot_colors;
  const auto number = [](double value) { return format_digits(value, 9); };
  std::string commands = make_data_block("data", data) + make_settings();
  if (!alarm_points.empty()) commands += make_data_block("marked", alarm_points);
  commands += fmt::format(
      "set xlabel 'runs, in the order of their end'\nset ylabel {} noenhanced\nset xrange {}\n"
      "set offsets 0, 0, graph 0.1, graph 0.1\n"
      "plot {} with lines dashtype 2 linecolor rgb '{}' title 'limits', "
      "{} with lines dashtype 2 linecolor rgb '{}' notitle, "
      "{} with lines linecolor rgb '{}' title 'mean', "
      "$data using 1:2 with linespoints pointtype 7 linecolor rgb '{}' title 'runs'",
      quote_for_gnuplot(title), format_gnuplot_range(0.5, double(points.size()) + 0.5),
      number(chart.upper), vermilion, number(chart.lower), vermilion, number(chart.mean), green,
      blue);
  if (gate) {
    commands +=
        fmt::format(", {} with lines dashtype 3 linewidth 2 linecolor rgb '{}' title 'gate'",
                    number(*gate), purple);
  }
  if (!alarm_points.empty()) {
    commands += fmt::format(
        ", $marked using 1:2 with points pointtype 4 pointsize 2 linewidth 2 linecolor rgb '{}' "
        "title 'alarms'",
        vermilion);
  }
  write_plot(file, {"trend", 1000, 480, commands + "\n"});
}

}  // namespace vlp
