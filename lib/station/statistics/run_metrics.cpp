// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/statistics/run_metrics.h"

#include <fmt/core.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace vlp {

std::vector<MetricKind> list_run_metrics() {
  auto kinds = list_unit_metrics();
  const auto fix_metrics = list_metric_kinds({MetricSource::evaluation});
  kinds.insert(kinds.end(), fix_metrics.begin(), fix_metrics.end());
  return kinds;
}

MetricKind require_run_metric_kind(const std::string& name) {
  const auto kinds = list_run_metrics();
  const auto kind = std::ranges::find(kinds, name, &MetricKind::name);
  if (kind != kinds.end()) return *kind;
  std::string names;
  for (const MetricKind& any : kinds) names.append(names.empty() ? "" : ", ").append(any.name);
  throw std::invalid_argument("there is no metric " + name + "; the metrics are: " + names);
}

std::vector<TrendPoint> load_metric_values(Records& records, const std::string& metric,
                                           RunFilter filter) {
  if (!filter.verdict.empty()) return records.load_metric_trend(metric, filter);
  const int last = std::exchange(filter.last, 0);
  auto points = records.load_metric_trend(metric, filter);
  std::erase_if(points, [](const TrendPoint& point) {
    return point.verdict == verdict_name(Verdict::invalid);
  });
  return keep_last_rows(std::move(points), last);
}

void check_one_station(const std::vector<TrendPoint>& points) {
  for (const TrendPoint& point : points) {
    if (point.station == points.front().station) continue;
    throw std::invalid_argument(
        fmt::format("there are runs of {} and of {}: select a station with --of-station, or use "
                    "--of-station any",
                    points.front().station, point.station));
  }
}

std::optional<double> find_gate_limit(const std::string& metric, const StationConfig* station,
                                      Records& records, const std::vector<TrendPoint>& points) {
  if (station != nullptr) {
    for (const Gate& gate : station->gates) {
      if (gate.metric == metric) return gate.limit;
    }
    return std::nullopt;
  }
  const auto last = points.empty() ? std::nullopt : records.find_run_by_id(points.back().run);
  const CheckedMetric* gate = last ? last->find_metric(metric) : nullptr;
  return gate != nullptr ? gate->limit : std::nullopt;
}

ToleranceLimits make_specification_limits(const MetricKind& kind, std::optional<double> gate) {
  if (kind.direction == Direction::at_least) return {gate, std::nullopt};
  return {std::nullopt, gate};
}

std::vector<StudyValue> select_study_values(const std::vector<TrendPoint>& points,
                                            const std::vector<std::string>& units) {
  std::map<std::string, std::size_t> runs;
  for (const TrendPoint& point : points) ++runs[point.camera];
  std::string unknown;
  for (const std::string& unit : units) {
    if (!runs.contains(unit)) unknown.append(unknown.empty() ? "" : ", ").append(unit);
  }
  if (!unknown.empty()) {
    throw std::invalid_argument("no judged run with this metric is of: " + unknown);
  }
  std::vector<StudyValue> values;
  for (const TrendPoint& point : points) {
    const bool named = std::count(units.begin(), units.end(), point.camera) > 0;
    if (named || (units.empty() && runs[point.camera] > 1)) {
      values.push_back({point.camera, point.station, point.value});
    }
  }
  return values;
}

void check_no_shared_images(Records& records, const std::vector<TrendPoint>& points,
                            const std::vector<StudyValue>& values) {
  std::map<std::string, std::vector<RunRecord>> runs_of_unit;
  for (const StudyValue& value : values) runs_of_unit[value.unit];
  for (const TrendPoint& point : points) {
    const auto runs = runs_of_unit.find(point.camera);
    if (runs == runs_of_unit.end()) continue;
    auto run = records.find_run_by_id(point.run);
    if (!run) continue;
    for (const RunRecord& earlier : runs->second) {
      if (!has_images_of(*run, earlier) && !has_images_of(earlier, *run)) continue;
      throw std::invalid_argument(
          fmt::format("runs {} and {} of camera {} have the same images, which is no repetition: "
                      "use new images, or void one of them",
                      earlier.run, run->run, point.camera));
    }
    runs->second.push_back(std::move(*run));
  }
}

std::vector<ReferenceValue> select_reference_values(
    const std::vector<TrendPoint>& points, const std::map<std::string, double>& references) {
  std::vector<std::string> units;
  units.reserve(references.size());
  for (const auto& [unit, reference] : references) units.push_back(unit);
  std::vector<ReferenceValue> values;
  for (const auto& [unit, station, value] : select_study_values(points, units)) {
    values.push_back({unit, references.at(unit), value});
  }
  return values;
}

std::optional<double> RunCounts::compute_yield() const {
  if (units_judged == 0) return std::nullopt;
  return static_cast<double>(units_passed) / static_cast<double>(units_judged);
}

std::optional<double> RunCounts::compute_first_pass_yield() const {
  if (cameras == 0) return std::nullopt;
  return static_cast<double>(cameras_passed_first) / static_cast<double>(cameras);
}

RunCounts count_runs(std::span<const RunSummary> runs) {
  RunCounts counts;
  std::map<std::string, int> judged;
  for (const RunSummary& run : runs) {
    if (!run.voided.empty()) {
      ++counts.voided;
      continue;
    }
    const bool passed = run.verdict == verdict_name(Verdict::pass);
    const bool failed = run.verdict == verdict_name(Verdict::fail);
    if (passed) ++counts.passed;
    if (failed) ++counts.failed;
    if (run.verdict == verdict_name(Verdict::invalid)) ++counts.invalid;
    if (run.kind != "unit") continue;
    if (passed) ++counts.units_passed;
    if (!passed && !failed) continue;
    ++counts.units_judged;
    if (const auto runs_of_camera = ++judged[run.camera]; runs_of_camera == 1) {
      ++counts.cameras;
      if (passed) ++counts.cameras_passed_first;
    } else if (runs_of_camera == 2) {
      ++counts.cameras_reworked;
    }
  }
  return counts;
}

}  // namespace vlp
