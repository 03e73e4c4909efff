// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "evaluation/metric.h"
#include "station/records/records.h"
#include "station/station_config.h"
#include "station/statistics/bias_study.h"
#include "station/statistics/capability.h"
#include "station/statistics/measurement_study.h"

/// Input of trends, capability and studies: a metric over runs, with its gate.
namespace vlp {

/// Returns the kinds of all metrics that runs can have: those of units at a station
/// (list_unit_metrics()), followed by the errors of fixes, which sessions of archives have
/// (archive_runs.h).
std::vector<MetricKind> list_run_metrics();
/// Returns the metric of this name. Throws std::invalid_argument that lists the valid names.
MetricKind require_run_metric_kind(const std::string& name);

/// Returns the values of a metric in judged runs, or in runs of the verdict that the filter
/// selects.
std::vector<TrendPoint> load_metric_values(Records& records, const std::string& metric,
                                           RunFilter filter);

/// Checks that all values are of one station. Throws std::invalid_argument otherwise; several
/// stations are compared only on request.
void check_one_station(const std::vector<TrendPoint>& points);

/// Returns the gate of a metric in the station's configuration or, without a station, in the last
/// run. Returns std::nullopt if there is none.
std::optional<double> find_gate_limit(const std::string& metric, const StationConfig* station,
                                      Records& records, const std::vector<TrendPoint>& points);
ToleranceLimits make_specification_limits(const MetricKind& kind, std::optional<double> gate);

/// Returns the values of the named units; those of all units with two runs or more if `units` is
/// empty. Throws std::invalid_argument for units without a value.
std::vector<StudyValue> select_study_values(const std::vector<TrendPoint>& points,
                                            const std::vector<std::string>& units);
/// Checks that no two runs of a unit use the same images, because such runs do not show
/// repeatability. Throws std::invalid_argument that names two such runs. Ignores runs without
/// images.
void check_no_shared_images(Records& records, const std::vector<TrendPoint>& points,
                            const std::vector<StudyValue>& values);
/// Returns the values of reference units with their known values. Throws as
/// select_study_values().
std::vector<ReferenceValue> select_reference_values(
    const std::vector<TrendPoint>& points, const std::map<std::string, double>& references);

/// Numbers of runs by result; voided runs are counted separately.
struct RunCounts {
  std::size_t passed = 0, failed = 0, invalid = 0, voided = 0;
  /// Number of judged runs of units that passed, and number of all judged runs of units.
  std::size_t units_passed = 0, units_judged = 0;
  /// Cameras with judged runs as units: all, those whose first run passed, and those with two runs
  /// or more.
  std::size_t cameras = 0, cameras_passed_first = 0, cameras_reworked = 0;

  /// Returns the fraction of runs of units that passed, std::nullopt if no unit was judged.
  std::optional<double> compute_yield() const;
  /// Returns the fraction of cameras whose first run passed, std::nullopt if no unit was judged.
  std::optional<double> compute_first_pass_yield() const;
};

/// Counts runs. `runs` are in chronological order.
RunCounts count_runs(std::span<const RunSummary> runs);

}  // namespace vlp
