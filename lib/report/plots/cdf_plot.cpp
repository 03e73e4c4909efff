// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/cdf_plot.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "report/plots/plot_parts.h"
#include "report/plots/round_numbers.h"

namespace vlp {
namespace {

constexpr std::size_t kMaxSteps = 500;
constexpr std::array<const char*, 4> kColors = {plot_colors::blue, plot_colors::vermilion,
                                                plot_colors::green, plot_colors::purple};

/// Returns rows of error in mm and cumulative fraction in percent.
std::string format_steps(std::vector<double> errors_m) {
  std::sort(errors_m.begin(), errors_m.end());
  const std::size_t count = errors_m.size(), steps = std::min(count, kMaxSteps);
  std::string rows = format_data_row({0, 0});
  for (std::size_t i = 1; i <= steps; ++i) {
    const std::size_t rank = count * i / steps;
    rows += format_data_row({1e3 * errors_m[rank - 1], 100 * double(rank) / double(count)});
  }
  return rows;
}

/// Returns the data blocks of a curve: its steps and its two marks.
std::string format_blocks(const CdfPlot::Curve& curve, const std::string& number) {
  return data_block("curve" + number, format_steps(curve.errors_m)) +
         data_block("marks" + number, format_data_row({1e3 * curve.p50_m, 50}) +
                                          format_data_row({1e3 * curve.p90_m, 90}));
}

std::string format_layer(const CdfPlot::Curve& curve, std::size_t i) {
  const std::string number = std::to_string(i),
                    color = std::string(" linecolor rgb '") + kColors[i % kColors.size()] + "' ",
                    style = " dashtype " + std::to_string(i + 1) + color,
                    label = curve.label + ": p50 " + format_mm(curve.p50_m) + " mm, p90 " +
                            format_mm(curve.p90_m) + " mm";
  return "$curve" + number + " using 1:2 with steps linewidth 2.5" + style + "title " +
         gnuplot_quoted(label) + " noenhanced, $marks" + number +
         " using 1:2 with points pointtype " + std::to_string(5 + 2 * (i % kColors.size())) +
         " pointsize 1.3" + color + "notitle";
}

}  // namespace

Drawing make_drawing(const CdfPlot& plot) {
  assert(!plot.curves.empty());
  constexpr double off_the_picture = 4, margin = 1.05;
  double largest_m = 0, largest_p90_m = 0;
  for (const auto& curve : plot.curves) {
    largest_m =
        std::max(largest_m, *std::max_element(curve.errors_m.begin(), curve.errors_m.end()));
    largest_p90_m = std::max(largest_p90_m, curve.p90_m);
  }
  const bool cut = largest_p90_m > 0 && largest_m > off_the_picture * largest_p90_m;
  const double range_m = cut ? off_the_picture * largest_p90_m : std::max(largest_m, 1e-6);

  std::string blocks, layers;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    blocks += format_blocks(plot.curves[i], std::to_string(i));
    layers.append(layers.empty() ? "plot " : ", ").append(format_layer(plot.curves[i], i));
  }
  const std::string beyond =
      cut ? "; the largest, " + format_mm(largest_m) + " mm, is off the picture" : "";
  return {"cdf", 720, 460 + 24 * static_cast<int>(plot.curves.size()),
          blocks + plot_settings() + "set title " + gnuplot_quoted(plot.title) +
              " noenhanced\n"
              "set xlabel 'horizontal error (mm)" +
              beyond +
              "'\n"
              "set ylabel 'share of fixes no further off (%)'\n"
              "set key vertical maxrows " +
              std::to_string(plot.curves.size()) + "\nset xrange " +
              plot_range(0, 1e3 * margin * range_m) +
              "\nset yrange [0:102]\nset ytics (0, 25, 50, 75, 90, 100)\n" + layers + "\n"};
}

}  // namespace vlp
