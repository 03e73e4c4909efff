// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/errors/bootstrap.h"
#include "station/statistics/capability.h"

namespace vlp {

/// Row of an analysis of variance.
struct AnovaRow {
  double dof = 0, sum_of_squares = 0;
  double mean_square() const { return dof > 0 ? sum_of_squares / dof : 0; }
};

/// Repeatability and reproducibility of a crossed study, in the unit of the metric (AIAG MSA, 4th
/// ed., appendix A; Montgomery and Runger 1993, Quality Engineering 6, 115-135 and 289-305).
///
/// p units (parts) are measured r times on each of o stations (appraisers). All effects are random:
///
///   y_ijk = m + unit_i + station_j + interaction_ij + e_ijk
///
/// With the mean squares MS of a two-way analysis of variance (s: station, u: unit, i: interaction)
/// the variance components are
///
///   e^2 = MS_e,                           interaction^2 = (MS_i - MS_e) / r,
///   station^2 = (MS_s - MS_i) / (p r),    unit^2 = (MS_u - MS_i) / (o r),
///
/// or 0 if negative. The interaction is not significant if chance exceeds F = MS_i / MS_e in more
/// than 5 % of studies. It is then pooled with the error: MS_e = (SS_i + SS_e) / (dof_i + dof_e),
/// which also replaces MS_i. The members from `repeatability` to `total` are standard deviations.
struct MeasurementStudy {
  std::size_t units = 0, stations = 0, repeats = 0;
  AnovaRow unit, station, interaction, error;
  double mean = 0;
  /// Probability of a larger MS_i / MS_e by chance; std::nullopt with one station.
  std::optional<double> interaction_p;
  /// True if the interaction was pooled with the error.
  bool pooled = false;

  /// AIAG's EV (equipment variation, e), AV (appraiser variation, station) and INT (interaction).
  /// The last two are 0 with one station, because they cannot be determined.
  double repeatability = 0, station_sd = 0, interaction_sd = 0;
  /// AIAG's GRR = sqrt(EV^2 + AV^2 + INT^2), PV (part variation), and TV (total variation). By the
  /// manual's rule 100 GRR / TV is acceptable up to 10 and unacceptable above 30.
  double grr = 0, unit_sd = 0, total = 0;
  /// 95 % intervals of GRR, of GRR / TV and of the unrounded ndc, by generalized pivotal quantities
  /// (Burdick, Borror and Montgomery 2005, "Design and Analysis of Gauge R&R Studies", SIAM,
  /// section 3.5): percentiles of the figures with MS dof / chi2(dof) in place of each MS. Few
  /// stations make them wide: with two, AV has one degree of freedom.
  Interval grr_interval{}, grr_fraction_interval{}, categories_interval{};
  /// Factor of the ndc in the manual.
  static constexpr double kCategoriesPerRatio = 1.41;
  /// Returns AIAG's ndc = 1.41 PV / GRR, truncated and at least 1; the manual requires 5. Returns
  /// std::nullopt if GRR is 0.
  std::optional<int> count_distinct_categories() const;
  /// Returns the precision-to-tolerance ratio P/T in percent: 600 GRR / (U - L). With a single
  /// limit it is 300 GRR / (U - mean) or 300 GRR / (mean - L). Returns std::nullopt without a
  /// limit, and if the mean is at or beyond the single limit.
  std::optional<double> precision_to_tolerance_percent(const ToleranceLimits& limits) const;
};

/// Measured value of a unit on a station.
struct StudyValue {
  std::string unit, station;
  double value;
};

/// Analyzes a crossed study. Throws std::invalid_argument for fewer than two units or repeats, or
/// if the number of repeats differs between units or stations; the message names what is missing.
MeasurementStudy analyze_study(const std::vector<StudyValue>& values);

}  // namespace vlp
