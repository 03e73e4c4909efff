// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/metric.h"
#include "station/records/records.h"
#include "station/station_config.h"
#include "station/statistics/bias_study.h"
#include "station/statistics/capability.h"
#include "station/statistics/measurement_study.h"

/// What trends, capability and studies are made of: a figure over runs, with its gate.
namespace vlp {

/// Those that runs have: unit_metrics(), and of the sessions of an archive (archive_runs.h) what
/// errors their fixes have.
std::vector<MetricKind> run_figures();
/// The one of this name. Throws std::invalid_argument, which names those there are.
MetricKind run_figure(const std::string& name);

/// The values of runs that were judged, unless the filter asks for one verdict.
std::vector<TrendPoint> judged_values(Records& records, const std::string& figure,
                                      RunFilter filter);

/// Throws std::invalid_argument for values of two stations, which are not compared unless that is
/// asked for.
void check_one_station(const std::vector<TrendPoint>& points);

/// The gate of a figure: that of the station, or, without one, of the last of the runs.
std::optional<double> gate_of(const std::string& figure, const StationConfig* station,
                              Records& records, const std::vector<TrendPoint>& points);
ToleranceLimits limits_of(const MetricKind& kind, std::optional<double> gate);

/// The values of a study's units: of those that are named, or of those with two runs or more.
/// Throws std::invalid_argument for units of which there is none.
std::vector<StudyValue> study_values(const std::vector<TrendPoint>& points,
                                     const std::vector<std::string>& units);
/// Throws std::invalid_argument, which names them, if two runs of one of the units use the same
/// images: they show no repeatability. Runs without images are not compared.
void check_repetitions(Records& records, const std::vector<TrendPoint>& points,
                       const std::vector<StudyValue>& values);
/// Those of reference units, with what their figure is known to be. Throws as study_values().
std::vector<ReferenceValue> reference_values(const std::vector<TrendPoint>& points,
                                             const std::map<std::string, double>& references);

}  // namespace vlp
