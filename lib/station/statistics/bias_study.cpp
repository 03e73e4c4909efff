// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/bias_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "report/plots/gnuplot.h"
#include "report/plots/plot_parts.h"
#include "station/statistics/distributions.h"

namespace vlp {
namespace {

constexpr double kLevel = 0.05;

/// Computes the sum of (x - mean x) (y - mean y).
double sum_of_products(const std::vector<double>& x, const std::vector<double>& y) {
  const double mean_x = compute_mean(x), mean_y = compute_mean(y);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - mean_x) * (y[i] - mean_y);
  return sum;
}

EstimateTest test_estimate(double value, double standard_error, double dof) {
  EstimateTest estimate{value, standard_error, dof, 0, 1, value, value};
  if (standard_error > 0) {
    estimate.t = value / standard_error;
    estimate.p = compute_t_probability(estimate.t, dof);
    const double half = compute_t_quantile(kLevel, dof) * standard_error;
    estimate.low = value - half;
    estimate.high = value + half;
  } else if (value != 0) {
    estimate.t = std::copysign(std::numeric_limits<double>::infinity(), value);
    estimate.p = 0;
  }
  return estimate;
}

Linearity fit_line(const std::vector<double>& references, const std::vector<double>& differences) {
  Linearity line;
  line.count = static_cast<double>(references.size());
  line.mean_reference = compute_mean(references);
  line.reference_squares = sum_of_products(references, references);
  const double slope = sum_of_products(references, differences) / line.reference_squares,
               mean = compute_mean(differences), intercept = mean - slope * line.mean_reference;
  double residuals = 0;
  for (std::size_t i = 0; i < references.size(); ++i) {
    const double fitted = mean + slope * (references[i] - line.mean_reference);
    residuals += std::pow(differences[i] - fitted, 2);
  }
  const double dof = line.count - 2, all = sum_of_products(differences, differences);
  line.residual_sd = std::sqrt(residuals / dof);
  line.r_squared = all > 0 ? 1 - residuals / all : 0;
  line.slope = test_estimate(slope, line.residual_sd / std::sqrt(line.reference_squares), dof);
  line.intercept = test_estimate(
      intercept,
      line.residual_sd * std::sqrt(1 / line.count + line.mean_reference * line.mean_reference /
                                                        line.reference_squares),
      dof);
  return line;
}

}  // namespace

bool EstimateTest::is_significant() const { return p < kLevel; }

double Linearity::predict_bias_at(double reference) const {
  return intercept.value + slope.value * reference;
}

double Linearity::half_width_at(double reference) const {
  const double offset = reference - mean_reference;
  return compute_t_quantile(kLevel, slope.dof) * residual_sd *
         std::sqrt(1 / count + offset * offset / reference_squares);
}

BiasStudy analyze_bias(const std::vector<ReferenceValue>& values) {
  if (values.empty()) throw std::invalid_argument("a bias study needs runs of reference units");
  std::map<std::pair<double, std::string>, std::vector<double>> by_unit;
  std::vector<double> references, differences;
  for (const auto& [unit, reference, value] : values) {
    by_unit[{reference, unit}].push_back(value);
    references.push_back(reference);
    differences.push_back(value - reference);
  }
  BiasStudy study;
  double within = 0;  // sum of squared deviations from the units' means
  for (const auto& [key, unit_values] : by_unit) {
    const auto& [reference, unit] = key;
    if (unit_values.size() < 2) {
      throw std::invalid_argument(
          fmt::format("unit {} has one run: a bias study needs two or more of each", unit));
    }
    const auto n = static_cast<double>(unit_values.size());
    const double mean = compute_mean(unit_values),
                 squares = sum_of_products(unit_values, unit_values),
                 sd = std::sqrt(squares / (n - 1));
    within += squares;
    study.units.push_back({unit, reference, unit_values.size(), mean, sd,
                           test_estimate(mean - reference, sd / std::sqrt(n), n - 1)});
  }
  const auto count = static_cast<double>(values.size());
  const double dof = count - static_cast<double>(by_unit.size());
  study.overall_bias =
      test_estimate(compute_mean(differences), std::sqrt(within / dof / count), dof);
  const bool differ = study.units.front().reference < study.units.back().reference;
  if (differ) study.linearity = fit_line(references, differences);
  return study;
}

void write_bias_plot(const std::filesystem::path& file, const std::string& title,
                     const std::vector<ReferenceValue>& values, const BiasStudy& study) {
  std::string data, means, line;
  for (const auto& [unit, reference, value] : values) {
    data += format_data_row({reference, value - reference});
  }
  for (const UnitBias& unit : study.units) {
    means += format_data_row({unit.reference, unit.bias.value});
  }
  using namespace plot_colors;
  std::string commands = fmt::format(
      "{}{}{}set xlabel 'reference'\nset ylabel {} noenhanced\n"
      "set offsets graph 0.05, graph 0.05, graph 0.1, graph 0.1\n",
      make_data_block("data", data), make_data_block("means", means), make_settings(),
      quote_for_gnuplot(title + ", measured - reference"));
  if (study.linearity) {
    const double first = study.units.front().reference, last = study.units.back().reference;
    constexpr int parts = 50;
    for (int i = 0; i <= parts; ++i) {
      const double at = first + (last - first) * i / parts;
      const double bias = study.linearity->predict_bias_at(at),
                   band = study.linearity->half_width_at(at);
      line += format_data_row({at, bias, bias - band, bias + band});
    }
    commands += make_data_block("line", line);
  }
  commands += fmt::format(
      "plot 0 with lines dashtype 3 linecolor rgb '{}' title 'no bias', "
      "$data using 1:2 with points pointtype 6 linecolor rgb '{}' title 'runs', "
      "$means using 1:2 with points pointtype 7 pointsize 1.5 linecolor rgb '{}' title 'means'",
      purple, blue, blue);
  if (study.linearity) {
    commands += fmt::format(
        ", $line using 1:2 with lines linecolor rgb '{}' title 'line', "
        "$line using 1:3 with lines dashtype 2 linecolor rgb '{}' title '95 % band', "
        "$line using 1:4 with lines dashtype 2 linecolor rgb '{}' notitle",
        green, vermilion, vermilion);
  }
  write_plot(file, {"bias", 1000, 480, commands + "\n"});
}

}  // namespace vlp
