// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/control_chart.h"

#include <cmath>

#include "captures/csv_writer.h"
#include "report/plots/gnuplot.h"
#include "report/plots/plot_parts.h"

namespace vlp {

ControlChart control_chart(std::span<const double> values) {
  constexpr double limits_per_range = 2.66;
  constexpr std::size_t long_run = 8;
  ControlChart chart;
  if (values.empty()) return chart;
  const auto count = static_cast<double>(values.size());
  double ranges = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    // From the first, so that the mean of equal values is their value to the last bit.
    chart.mean += (values[i] - values.front()) / count;
    if (i > 0) ranges += std::abs(values[i] - values[i - 1]);
  }
  chart.mean += values.front();
  const double range = values.size() > 1 ? ranges / (count - 1) : 0;
  chart.lower = chart.mean - limits_per_range * range;
  chart.upper = chart.mean + limits_per_range * range;
  std::size_t in_a_row = 0;
  int last_side = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] < chart.lower || values[i] > chart.upper) chart.outside.push_back(i);
    const int side = values[i] > chart.mean ? 1 : values[i] < chart.mean ? -1 : 0;
    in_a_row = side == 0 ? 0 : side == last_side ? in_a_row + 1 : 1;
    last_side = side;
    if (in_a_row >= long_run) chart.drifting.push_back(i);
  }
  return chart;
}

void draw_trend(const std::filesystem::path& picture, const std::string& title,
                std::span<const TrendPoint> points) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const TrendPoint& point : points) values.push_back(point.value);
  const ControlChart chart = control_chart(values);
  std::vector<bool> outside(points.size());
  for (const std::size_t i : chart.outside) outside[i] = true;
  std::string data, marked;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string row = data_row({double(i + 1), values[i]});
    data += row;
    if (outside[i]) marked += row;
  }
  const auto level = [](double value, const std::string& look) {
    return significant(value, 9) + " with lines " + look;
  };
  const std::string limits = std::string("dashtype 2 linecolor rgb '") + plot_colors::vermillion;
  std::string commands = data_block("data", data) + plot_settings();
  if (!marked.empty()) commands += data_block("marked", marked);
  commands +=
      "set xlabel 'runs, in the order of their end'\nset ylabel " + gnuplot_quoted(title) +
      " noenhanced\nset xrange " + plot_range(0.5, double(points.size()) + 0.5) +
      "\nset offsets 0, 0, graph 0.1, graph 0.1\nplot " +
      level(chart.upper, limits + "' title 'limits'") + ", " +
      level(chart.lower, limits + "' notitle") + ", " +
      level(chart.mean, std::string("linecolor rgb '") + plot_colors::green + "' title 'mean'") +
      ", $data using 1:2 with linespoints pointtype 7 linecolor rgb '" + plot_colors::blue +
      "' title 'runs'";
  if (!marked.empty()) {
    commands += std::string(
                    ", $marked using 1:2 with points pointtype 4 pointsize 2 linewidth 2 "
                    "linecolor rgb '") +
                plot_colors::vermillion + "' title 'outside the limits'";
  }
  draw(picture, {"trend", 1000, 480, commands + "\n"});
}

}  // namespace vlp
