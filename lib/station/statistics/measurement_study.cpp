// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/measurement_study.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "station/statistics/distributions.h"

namespace vlp {
namespace {

double squares_about(const std::vector<double>& values, double center) {
  return std::accumulate(values.begin(), values.end(), 0.0, [&](double sum, double value) {
    return sum + (value - center) * (value - center);
  });
}

/// Values of each unit on each station, of equal number.
using Cells = std::map<std::string, std::map<std::string, std::vector<double>>>;

Cells cells_of(const std::vector<StudyValue>& values) {
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
MeasurementStudy analysis_of(const Cells& cells) {
  MeasurementStudy study;
  study.units = cells.size();
  study.stations = cells.begin()->second.size();
  study.repeats = cells.begin()->second.begin()->second.size();
  std::vector<double> of_units, of_cells;
  std::map<std::string, std::vector<double>> by_station;
  for (const auto& [unit, of_unit] : cells) {
    std::vector<double> means;
    for (const auto& [station, values] : of_unit) {
      means.push_back(mean_of(values));
      by_station[station].push_back(means.back());
      study.error.sum_of_squares += squares_about(values, means.back());
    }
    of_units.push_back(mean_of(means));
    of_cells.insert(of_cells.end(), means.begin(), means.end());
  }
  std::vector<double> of_stations;
  of_stations.reserve(by_station.size());
  for (const auto& [station, means] : by_station) of_stations.push_back(mean_of(means));
  study.mean = mean_of(of_units);
  const auto p = static_cast<double>(study.units), o = static_cast<double>(study.stations),
             r = static_cast<double>(study.repeats);
  study.unit = {p - 1, o * r * squares_about(of_units, study.mean)};
  study.station = {o - 1, p * r * squares_about(of_stations, study.mean)};
  study.error.dof = p * o * (r - 1);
  // From the cells, not as a difference of sums of all values.
  double both = 0;
  std::size_t cell = 0;
  for (const double of_unit : of_units) {
    for (const double of_station : of_stations) {
      both += std::pow(of_cells[cell++] - of_unit - of_station + study.mean, 2);
    }
  }
  study.both = {(p - 1) * (o - 1), r * both};
  return study;
}

double part_of(double larger, double smaller, double count) {
  return std::max(0.0, (larger - smaller) / count);
}

}  // namespace

MeasurementStudy measurement_study(const std::vector<StudyValue>& values) {
  constexpr double significant = 0.05;
  MeasurementStudy study = analysis_of(cells_of(values));
  double error = study.error.mean_square(), both = study.both.mean_square();
  if (study.stations > 1) {
    study.interaction_p = error > 0  ? f_upper_tail(both / error, study.both.dof, study.error.dof)
                          : both > 0 ? 0
                                     : 1;
  }
  study.pooled = study.interaction_p.value_or(1) > significant;
  if (study.pooled) {
    error = (study.both.sum_of_squares + study.error.sum_of_squares) /
            (study.both.dof + study.error.dof);
    both = error;
  }
  const auto p = static_cast<double>(study.units), o = static_cast<double>(study.stations),
             r = static_cast<double>(study.repeats);
  const double of_both = part_of(both, error, r),
               of_station =
                   study.stations > 1 ? part_of(study.station.mean_square(), both, p * r) : 0,
               of_unit = part_of(study.unit.mean_square(), both, o * r);
  study.repeatability = std::sqrt(error);
  study.of_both = std::sqrt(of_both);
  study.of_station = std::sqrt(of_station);
  study.of_unit = std::sqrt(of_unit);
  study.measuring = std::sqrt(error + of_both + of_station);
  study.total = std::sqrt(error + of_both + of_station + of_unit);
  return study;
}

std::optional<int> MeasurementStudy::distinct_categories() const {
  if (measuring <= 0) return std::nullopt;
  constexpr double per_ratio = 1.41, most = 1e6;
  return std::max(1, static_cast<int>(std::min(most, per_ratio * of_unit / measuring)));
}

std::optional<double> MeasurementStudy::percent_of_tolerance(const ToleranceLimits& limits) const {
  constexpr double percent = 100;
  if (limits.lower && limits.upper) {
    return percent * 6 * measuring / (*limits.upper - *limits.lower);
  }
  const double room = limits.upper ? *limits.upper - mean : limits.lower ? mean - *limits.lower : 0;
  return room > 0 ? std::optional(percent * 3 * measuring / room) : std::nullopt;
}

}  // namespace vlp
