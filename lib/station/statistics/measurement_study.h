// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "station/statistics/capability.h"

namespace vlp {

/// A line of an analysis of variance.
struct AnovaLine {
  double dof = 0, sum_of_squares = 0;
  double mean_square() const { return dof > 0 ? sum_of_squares / dof : 0; }
};

/// What a station's measuring adds to what its units differ by: repeatability and reproducibility
/// of a crossed study (AIAG MSA, 4th ed., appendix A; Montgomery and Runger 1993, Quality
/// Engineering 6, 115-135 and 289-305). p units are measured r times on each of o stations; y_ijk =
/// m + unit_i + station_j + both_ij + e_ijk, all random. With the mean squares of a two-way
/// analysis of variance
///
///   e^2 = MS_e,  both^2 = (MS_both - MS_e) / r,
///   station^2 = (MS_station - MS_both) / (p r),  unit^2 = (MS_unit - MS_both) / (o r),
///
/// 0 where negative. When `both` does not show (F = MS_both / MS_e is below what chance exceeds in
/// 5 % of studies) its squares go to the error's, MS_e = (SS_both + SS_e) / (dof_both + dof_e), and
/// MS_e stands for MS_both. All below are standard deviations, in the figure's unit.
struct MeasurementStudy {
  std::size_t units = 0, stations = 0, repeats = 0;
  AnovaLine unit, station, both, error;
  double mean = 0;
  /// P of so large a MS_both / MS_e by chance; nothing with one station.
  std::optional<double> interaction_p;
  /// Whether its squares went to the error's.
  bool pooled = false;

  /// e: EV of the manual. Station and both: AV and INT, 0 with one station, of which the study
  /// knows nothing.
  double repeatability = 0, of_station = 0, of_both = 0;
  /// GRR: sqrt(EV^2 + AV^2 + INT^2); PV; TV: of all. 100 GRR / TV up to 10 is good, above 30 bad
  /// (the manual's rule).
  double measuring = 0, of_unit = 0, total = 0;
  /// ndc: 1.41 PV / GRR, whole, and at least 1. Five are asked for. Nothing when GRR is 0.
  std::optional<int> distinct_categories() const;
  /// P/T in percent: 600 GRR / (U - L), or with one limit, of the room between mean and limit, 300
  /// GRR / (U - mean) or 300 GRR / (mean - L). Nothing without a limit, and when there is no such
  /// room: the mean is at the one limit or beyond it.
  std::optional<double> percent_of_tolerance(const ToleranceLimits& limits) const;
};

/// A value of a unit on a station.
struct StudyValue {
  std::string unit, station;
  double value;
};

/// Throws std::invalid_argument, which says what is missing: fewer than two units or repeats, or
/// not as many repeats of each unit on each station.
MeasurementStudy measurement_study(const std::vector<StudyValue>& values);

}  // namespace vlp
