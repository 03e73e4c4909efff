// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/budget_plot.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <numeric>

#include "captures/number_text.h"
#include "report/plots/plot_parts.h"

namespace vlp {
namespace {

constexpr std::size_t kMaxColumns = 200;
constexpr std::array<const char*, 5> kPartColors{plot_colors::gray, plot_colors::blue,
                                                 plot_colors::green, plot_colors::purple,
                                                 plot_colors::vermilion};

double compute_sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Returns one line per column: the variances in mm^2.
std::string format_columns(const BudgetPlot& plot) {
  auto fixes = plot.variances_m2;
  std::stable_sort(fixes.begin(), fixes.end(),
                   [](const auto& a, const auto& b) { return compute_sum(a) < compute_sum(b); });
  const std::size_t columns = std::min(fixes.size(), kMaxColumns);
  std::string rows;
  for (std::size_t i = 1; i <= columns; ++i) {
    for (const double variance_m2 : fixes[fixes.size() * i / columns - 1]) {
      rows.append(significant(1e6 * variance_m2, kPlotDigits)).append(" ");
    }
    rows.append("\n");
  }
  return rows;
}

}  // namespace

std::vector<double> BudgetPlot::fractions() const {
  std::vector<double> fractions(parts.size());
  double whole = 0;
  for (const auto& fix : variances_m2) {
    for (std::size_t i = 0; i < fix.size(); ++i) fractions[i] += fix[i];
    whole += compute_sum(fix);
  }
  for (double& fraction : fractions) fraction /= whole;
  return fractions;
}

Drawing make_drawing(const BudgetPlot& plot) {
  assert(!plot.variances_m2.empty() && plot.parts.size() <= kPartColors.size());
  const std::vector<double> fractions = plot.fractions();
  std::string layers;
  for (std::size_t i = 0; i < plot.parts.size(); ++i) {
    if (!(fractions[i] > 0)) continue;
    const std::string label = fmt::format("{}, {:.0f} %", plot.parts[i], 100 * fractions[i]);
    layers +=
        fmt::format("{}$budget using {} linecolor rgb '{}' title {} noenhanced",
                    layers.empty() ? "plot " : ", ", i + 1, kPartColors[i], gnuplot_quoted(label));
  }
  return {"budget", 720, 520,
          data_block("budget", format_columns(plot)) + plot_settings() + "set title " +
              gnuplot_quoted(plot.title) +
              " noenhanced\n"
              "set xlabel 'fixes, the most certain first'\n"
              "set ylabel 'horizontal variance (mm²)'\n"
              "set style data histograms\n"
              "set style histogram rowstacked\n"
              "set style fill solid 1 border rgb 'white'\n"
              "set boxwidth 1\n"
              "set yrange [0:*]\n"
              "unset xtics\n" +
              layers + "\n"};
}

}  // namespace vlp
