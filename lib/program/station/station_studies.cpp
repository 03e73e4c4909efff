// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "program/app.h"
#include "program/station/known_runs.h"
#include "program/station/station_records.h"
#include "station/statistics/bias_study.h"
#include "station/statistics/capability.h"
#include "station/statistics/control_chart.h"
#include "station/statistics/measurement_study.h"
#include "station/statistics/run_metrics.h"

namespace vlp {
namespace {

/// Returns filter_by_options() restricted to units, unless --kind is given.
RunFilter filter_comparable(const StationRecordsOptions& options, const KnownRuns& known) {
  RunFilter filter = filter_by_options(options, known);
  if (options.filter.kind.empty()) filter.kind = "unit";
  return filter;
}

/// Checks that all points are from one station, if neither options nor filter name a station.
void check_one_station(const std::vector<TrendPoint>& points,
                       const StationRecordsOptions& options) {
  if (options.station.empty() && options.filter.station.empty()) check_one_station(points);
}

/// Returns the result of a study. Converts std::invalid_argument to Undetermined.
template <typename Study>
auto run_study(const Study& study) {
  try {
    return study();
  } catch (const std::invalid_argument& error) {
    throw Undetermined(error.what());
  }
}

/// Parses reference values UNIT=VALUE. Returns them by unit.
std::map<std::string, double> parse_references(const std::vector<std::string>& texts) {
  std::map<std::string, double> references;
  for (const std::string& text : texts) {
    const auto at = text.rfind('=');
    std::istringstream number(at == std::string::npos ? "" : text.substr(at + 1));
    double value = 0;
    if (at == 0 || !(number >> value) || !number.eof() || !std::isfinite(value)) {
      throw std::invalid_argument("--reference: should be UNIT=VALUE, not " + text);
    }
    if (!references.emplace(text.substr(0, at), value).second) {
      throw std::invalid_argument("--reference: " + text.substr(0, at) + " occurs twice");
    }
  }
  return references;
}

std::string format_estimate_test(const EstimateTest& estimate) {
  return fmt::format("{:>12.4g}{:>12.3g}{:>9.2f}{:>9.4f}   {:.4g} to {:.4g}{}", estimate.value,
                     estimate.standard_error, estimate.t, estimate.p, estimate.low, estimate.high,
                     estimate.is_significant() ? "   shows" : "");
}

/// Prints bias and linearity of a station against reference units.
void print_bias(const MetricKind& kind, const StationRecordsOptions& options) {
  const auto references = parse_references(options.references);
  KnownRuns known = open_runs(options);
  check_output_option(options, known);
  const auto points = load_metric_values(known.runs.records_or_throw(), options.metric,
                                         filter_comparable(options, known));
  check_one_station(points, options);
  const auto values = select_reference_values(points, references);
  std::vector<std::string> units;
  units.reserve(references.size());
  for (const auto& [unit, reference] : references) units.push_back(unit);
  const BiasStudy study = run_study([&] {
    check_no_shared_images(known.runs.records_or_throw(), points,
                           select_study_values(points, units));
    return analyze_bias(values);
  });
  constexpr const char* head = "{:<20}{:>10}{:>6}{:>12}{:>12}{:>9}{:>9}   {}";
  print_line(fmt::format("{}: bias against {} reference units, {}", options.metric,
                         study.units.size(),
                         std::string_view(kind.unit).empty() ? "a fraction" : kind.unit));
  fmt::print("\n");
  print_line(
      fmt::format(head, "unit", "reference", "runs", "bias", "se", "t", "p", "95 % interval"));
  for (const UnitBias& unit : study.units) {
    print_line(fmt::format("{:<20}{:>10.4g}{:>6}{}", unit.unit, unit.reference, unit.count,
                           format_estimate_test(unit.bias)));
  }
  const auto line = [](const char* name, const EstimateTest& estimate) {
    fmt::print("{:<36}{}\n", name, format_estimate_test(estimate));
  };
  line("all", study.overall_bias);
  if (study.linearity) {
    const Linearity& linearity = *study.linearity;
    fmt::print("\nbias = intercept + slope x reference\n");
    line("slope", linearity.slope);
    line("intercept", linearity.intercept);
    fmt::print("residual sd {:.4g}, R^2 {:.1f} %\n\n{:<20}{:>10}{:>18}   95 % band\n",
               linearity.residual_sd, 100 * linearity.r_squared, "", "reference", "line");
    for (const UnitBias& unit : study.units) {
      const double at = linearity.predict_bias_at(unit.reference),
                   half = linearity.half_width_at(unit.reference);
      print_line(fmt::format("{:<20}{:>10.4g}{:>18.4g}   {:.4g} to {:.4g}{}", unit.unit,
                             unit.reference, at, at - half, at + half,
                             std::abs(at) > half ? "   without 0" : ""));
    }
  }
  if (!options.output.empty()) write_bias_plot(options.output, options.metric, values, study);
}

}  // namespace

void print_metric_trend(const StationRecordsOptions& options) {
  const MetricKind kind = require_run_metric_kind(options.metric);
  KnownRuns known = open_runs(options);
  check_output_option(options, known);
  Records& records = known.runs.records_or_throw();
  RunFilter filter = filter_comparable(options, known);
  if (options.filter.verdict.empty()) filter.verdict = verdict_name(Verdict::pass);
  const auto points = records.load_metric_trend(options.metric, filter);
  check_one_station(points, options);
  constexpr std::size_t min_points = 2;
  if (points.size() < min_points) {
    throw Undetermined(
        fmt::format("{} of the runs have {}: a trend needs two", points.size(), options.metric));
  }
  const std::vector<double> values = extract_trend_values(points);
  const auto alarms = list_chart_alarms(values, options.rules);
  const ControlChart chart = make_control_chart(values);
  const auto gate = find_gate_limit(options.metric, known.station_config(), records, points);
  if (!options.output.empty())
    write_trend_plot(options.output, options.metric, points, alarms, gate);
  print_line(fmt::format("{} of {} runs, {} to {}", options.metric, points.size(),
                         points.front().ended_utc, points.back().ended_utc));
  fmt::print("mean      {:.4g} {}\nlimits    {:.4g} to {:.4g}\n", chart.mean, kind.unit,
             chart.lower, chart.upper);
  if (gate) fmt::print("gate      {} {:.4g}\n", describe_direction(kind.direction), *gate);
  for (const ChartAlarm& alarm : alarms) {
    const TrendPoint& point = points[alarm.index];
    print_line(fmt::format("{} {} {} {:.4g}  {}: {}", point.ended_utc, point.run, point.camera,
                           point.value, alarm.rule, alarm.description));
  }
  const auto recent = keep_recent_alarms(alarms, points.size(), options.window);
  if (recent.empty()) return;
  throw GateNotMet(fmt::format("{}: {} alarms in the last {} runs, the last {} at {}",
                               options.metric, recent.size(), options.window, recent.back().rule,
                               points[recent.back().index].run));
}

void print_capability(const StationRecordsOptions& options) {
  std::vector<MetricKind> kinds = list_run_metrics();
  if (!options.metric.empty()) kinds = {require_run_metric_kind(options.metric)};
  KnownRuns known = open_runs(options);
  Records& records = known.runs.records_or_throw();
  const RunFilter filter = filter_comparable(options, known);
  constexpr const char* head = "{:<27}{:>5}{:>10}{:>10}{:>10}{:>10}   {:<25}{}";
  std::vector<std::string> rows;
  rows.reserve(kinds.size());
  for (const MetricKind& kind : kinds) {
    const auto points = load_metric_values(records, kind.name, filter);
    check_one_station(points, options);
    const auto gate = find_gate_limit(kind.name, known.station_config(), records, points);
    const auto found =
        compute_capability(extract_trend_values(points), make_specification_limits(kind, gate));
    if (!found) continue;
    const auto index = [](const CapabilityIndex& of) {
      return fmt::format("{:.2f} ({:.2f} to {:.2f})", of.value, of.low, of.high);
    };
    rows.push_back(fmt::format(
        head, kind.name, found->count, fmt::format("{:.4g}", found->mean),
        fmt::format("{:.3g}", found->within_sd), fmt::format("{:.3g}", found->overall_sd),
        fmt::format("{} {:.4g}",
                    kind.direction == Direction::at_least ? ">=" : "<=", gate.value_or(0)),
        index(found->cpk), index(found->ppk)));
  }
  if (rows.empty()) {
    throw Undetermined("no metric with a gate has two different values in judged runs");
  }
  print_line(fmt::format(head, "metric", "runs", "mean", "sd within", "overall", "gate",
                         "Cpk (95 %)", "Ppk (95 %)"));
  for (const std::string& row : rows) print_line(row);
}

void print_gauge_study(const StationRecordsOptions& options) {
  const MetricKind kind = require_run_metric_kind(options.metric);
  if (!options.references.empty()) return print_bias(kind, options);
  KnownRuns known = open_runs(options);
  Records& records = known.runs.records_or_throw();
  RunFilter filter = options.filter;
  if (filter.kind.empty()) filter.kind = "unit";
  const auto points = load_metric_values(records, options.metric, remove_any_conditions(filter));
  const auto values = select_study_values(points, options.units);
  const MeasurementStudy study = run_study([&] {
    check_no_shared_images(records, points, values);
    return analyze_study(values);
  });
  const auto gate = find_gate_limit(options.metric, known.station_config(), records, points);
  print_line(fmt::format("{}: {} units, {} stations, {} runs each, mean {:.4g} {}", options.metric,
                         study.units, study.stations, study.repeats, study.mean, kind.unit));
  fmt::print("\n");
  fmt::print("{:<18}{:>5}{:>14}{:>14}\n", "", "dof", "squares", "mean square");
  for (const auto& [name, line] :
       {std::pair("units", study.unit), std::pair("stations", study.station),
        std::pair("units x stations", study.interaction), std::pair("error", study.error)}) {
    fmt::print("{:<18}{:>5}{:>14.5g}{:>14.5g}\n", name, line.dof, line.sum_of_squares,
               line.mean_square());
  }
  if (study.interaction_p) {
    fmt::print("units x stations by chance with p = {:.3f}: {}\n", *study.interaction_p,
               study.pooled ? "pooled with the error" : "significant");
  }
  fmt::print("\n{:<34}{:>12}{:>14}\n", "", "sd", "% of total");
  const auto part = [&](const char* name, double sd) {
    constexpr double percent = 100;
    fmt::print("{:<34}{:>12.5g}{:>14.1f}\n", name, sd,
               study.total > 0 ? percent * sd / study.total : 0);
  };
  part("repeatability (EV)", study.repeatability);
  if (study.stations > 1) {
    part("stations (AV)", study.station_sd);
    part("units x stations (INT)", study.interaction_sd);
  }
  part("measurement, total (GRR)", study.grr);
  part("units (PV)", study.unit_sd);
  part("total (TV)", study.total);
  if (const auto categories = study.count_distinct_categories()) {
    fmt::print("distinct categories (ndc){:>21}\n", *categories);
    const auto& [grr, fraction, ndc] =
        std::tie(study.grr_interval, study.grr_fraction_interval, study.categories_interval);
    constexpr double percent = 100;
    fmt::print(
        "95 % intervals: GRR {:.4g} to {:.4g}, {:.1f} to {:.1f} % of total; ndc {:.1f} to "
        "{:.1f}\n",
        grr.low, grr.high, percent * fraction.low, percent * fraction.high, ndc.low, ndc.high);
  }
  if (const auto percent_of_tolerance =
          study.precision_to_tolerance_percent(make_specification_limits(kind, gate))) {
    fmt::print("measurement / tolerance (P/T){:>17.1f} %\n", *percent_of_tolerance);
  } else if (gate) {
    fmt::print("no P/T: the mean is not within the gate, {} {:.4g}\n",
               describe_direction(kind.direction), *gate);
  }
  if (study.stations == 1) {
    fmt::print("\nOne station: differences between stations are unknown.\n");
  }
}

}  // namespace vlp
