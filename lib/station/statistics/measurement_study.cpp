// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/measurement_study.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "evaluation/errors/split_mix.h"
#include "station/statistics/distributions.h"

namespace vlp {
namespace {

double sum_squares_about(const std::vector<double>& values, double center) {
  return std::accumulate(values.begin(), values.end(), 0.0, [&](double sum, double value) {
    return sum + (value - center) * (value - center);
  });
}

/// Values of each unit on each station, of equal number.
using Cells = std::map<std::string, std::map<std::string, std::vector<double>>>;

Cells group_cells(const std::vector<StudyValue>& values) {
  Cells cells;
  std::set<std::string> stations;
  for (const auto& [unit, station, value] : values) {
    cells[unit][station].push_back(value);
    stations.insert(station);
  }
  if (cells.size() < 2) throw std::invalid_argument("a study needs two units or more");
  // By name: the loop adds the stations that a unit lacks.
  const std::string first = cells.begin()->second.begin()->first;
  const std::size_t repeats = cells.begin()->second.begin()->second.size();
  for (auto& [unit, of_unit] : cells) {
    for (const std::string& station : stations) {
      const std::size_t found = of_unit[station].size();
      if (found == repeats && found >= 2) continue;
      throw std::invalid_argument(fmt::format(
          "unit {} has {} runs on {}, {} has {} on {}: a study needs as many of each unit on each "
          "station, two or more",
          unit, found, station, cells.begin()->first, repeats, first));
    }
  }
  return cells;
}

/// Computes sums of squares and degrees of freedom.
MeasurementStudy analyze_variance(const Cells& cells) {
  MeasurementStudy study;
  study.units = cells.size();
  study.stations = cells.begin()->second.size();
  study.repeats = cells.begin()->second.begin()->second.size();
  std::vector<double> unit_means, cell_means;
  std::map<std::string, std::vector<double>> by_station;
  for (const auto& [unit, of_unit] : cells) {
    std::vector<double> means;
    for (const auto& [station, values] : of_unit) {
      means.push_back(compute_mean(values));
      by_station[station].push_back(means.back());
      study.error.sum_of_squares += sum_squares_about(values, means.back());
    }
    unit_means.push_back(compute_mean(means));
    cell_means.insert(cell_means.end(), means.begin(), means.end());
  }
  std::vector<double> station_means;
  station_means.reserve(by_station.size());
  for (const auto& [station, means] : by_station) station_means.push_back(compute_mean(means));
  study.mean = compute_mean(unit_means);
  const auto p = static_cast<double>(study.units), o = static_cast<double>(study.stations),
             r = static_cast<double>(study.repeats);
  study.unit = {p - 1, o * r * sum_squares_about(unit_means, study.mean)};
  study.station = {o - 1, p * r * sum_squares_about(station_means, study.mean)};
  study.error.dof = p * o * (r - 1);
  // From the cells, not as a difference of sums of all values.
  double interaction = 0;
  std::size_t cell = 0;
  for (const double of_unit : unit_means) {
    for (const double of_station : station_means) {
      interaction += std::pow(cell_means[cell++] - of_unit - of_station + study.mean, 2);
    }
  }
  study.interaction = {(p - 1) * (o - 1), r * interaction};
  return study;
}

double variance_component(double larger, double smaller, double count) {
  return std::max(0.0, (larger - smaller) / count);
}

/// Sets the intervals of a study without or with a pooled interaction.
void compute_intervals(MeasurementStudy& study) {
  constexpr std::size_t draws = 4000, outside = draws / 40;  // 2.5 % on either side
  const auto p = static_cast<double>(study.units), o = static_cast<double>(study.stations),
             r = static_cast<double>(study.repeats);
  AnovaRow error = study.error;
  if (study.pooled) {
    error.dof += study.interaction.dof;
    error.sum_of_squares += study.interaction.sum_of_squares;
  }
  SplitMix random(1);
  const auto draw = [&](const AnovaRow& row) {
    constexpr double resolution = 0x1p-53;
    const double probability = (static_cast<double>(random() >> 11) + 0.5) * resolution;
    return row.sum_of_squares / compute_chi_square_quantile(probability, row.dof);
  };
  std::array<std::vector<double>, 3> figures;
  for (std::size_t i = 0; i < draws; ++i) {
    const double error_square = draw(error), unit_square = draw(study.unit);
    const double interaction_square = study.pooled ? error_square : draw(study.interaction);
    double grr_square = error_square;
    if (study.stations > 1) {
      grr_square =
          (draw(study.station) + (p - 1) * interaction_square + p * (r - 1) * error_square) /
          (p * r);
    }
    const double units_square = variance_component(unit_square, interaction_square, o * r);
    figures[0].push_back(std::sqrt(grr_square));
    figures[1].push_back(std::sqrt(grr_square / (grr_square + units_square)));
    figures[2].push_back(MeasurementStudy::kCategoriesPerRatio *
                         std::sqrt(units_square / grr_square));
  }
  const std::array intervals{&study.grr_interval, &study.grr_fraction_interval,
                             &study.categories_interval};
  for (std::size_t i = 0; i < figures.size(); ++i) {
    std::ranges::sort(figures[i]);
    *intervals[i] = {figures[i][outside - 1], figures[i][draws - outside]};
  }
}

}  // namespace

MeasurementStudy analyze_study(const std::vector<StudyValue>& values) {
  constexpr double significant = 0.05;
  MeasurementStudy study = analyze_variance(group_cells(values));
  double error = study.error.mean_square(), interaction = study.interaction.mean_square();
  if (study.stations > 1) {
    study.interaction_p = error > 0         ? compute_f_probability(interaction / error,
                                                                    study.interaction.dof, study.error.dof)
                          : interaction > 0 ? 0
                                            : 1;
  }
  study.pooled = study.interaction_p.value_or(1) > significant;
  if (study.pooled) {
    error = (study.interaction.sum_of_squares + study.error.sum_of_squares) /
            (study.interaction.dof + study.error.dof);
    interaction = error;
  }
  const auto p = static_cast<double>(study.units), o = static_cast<double>(study.stations),
             r = static_cast<double>(study.repeats);
  const double of_interaction = variance_component(interaction, error, r),
               of_station = study.stations > 1 ? variance_component(study.station.mean_square(),
                                                                    interaction, p * r)
                                               : 0,
               of_unit = variance_component(study.unit.mean_square(), interaction, o * r);
  study.repeatability = std::sqrt(error);
  study.interaction_sd = std::sqrt(of_interaction);
  study.station_sd = std::sqrt(of_station);
  study.unit_sd = std::sqrt(of_unit);
  study.grr = std::sqrt(error + of_interaction + of_station);
  study.total = std::sqrt(error + of_interaction + of_station + of_unit);
  if (error > 0) compute_intervals(study);
  return study;
}

std::optional<int> MeasurementStudy::count_distinct_categories() const {
  if (grr <= 0) return std::nullopt;
  constexpr double max_categories = 1e6;
  return std::max(1,
                  static_cast<int>(std::min(max_categories, kCategoriesPerRatio * unit_sd / grr)));
}

std::optional<double> MeasurementStudy::precision_to_tolerance_percent(
    const ToleranceLimits& limits) const {
  constexpr double percent = 100;
  if (limits.lower && limits.upper) {
    return percent * 6 * grr / (*limits.upper - *limits.lower);
  }
  const double margin = limits.upper   ? *limits.upper - mean
                        : limits.lower ? mean - *limits.lower
                                       : 0;
  return margin > 0 ? std::optional(percent * 3 * grr / margin) : std::nullopt;
}

}  // namespace vlp
