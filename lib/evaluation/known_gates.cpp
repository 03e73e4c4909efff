// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/known_gates.h"

#include <array>

#include "geometry/angles.h"

namespace vlp {
namespace {

constexpr double kMm = 1e3;

std::optional<double> height_rms_mm(const Evaluation& e) {
  return e.height_m ? std::optional(kMm * e.height_m->sizes.rms) : std::nullopt;
}
std::optional<double> yaw_rms_deg(const Evaluation& e) {
  return e.yaw_rad ? std::optional(deg_from_rad(e.yaw_rad->sizes.rms)) : std::nullopt;
}
std::optional<double> of_stations_mm(const Evaluation& e, double StationFigures::*figure) {
  return e.stations ? std::optional(kMm * (*e.stations).*figure) : std::nullopt;
}
std::optional<double> of_fit_mm(const Evaluation& e, double ErrorFigures::*figure) {
  return e.fit ? std::optional(kMm * e.fit->distances_m.*figure) : std::nullopt;
}
/// The end of the difference's interval that is nearer to better; nothing is certain of too few.
std::optional<double> worse_mm(const Evaluation& e) {
  if (!e.comparison || e.comparison->pairs == 0) return std::nullopt;
  return e.comparison->too_few() ? 0 : kMm * e.comparison->interval_m->low;
}

const std::array kKnown{
    KnownGate{"mean_mm", "mm", "mean horizontal error",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.mean); }},
    KnownGate{"median_mm", "mm", "median horizontal error",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.median); }},
    KnownGate{"p90_mm", "mm", "what 90 % of the horizontal errors do not exceed",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.p90); }},
    KnownGate{"max_mm", "mm", "largest horizontal error",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.max); }},
    KnownGate{"rms_mm", "mm", "root mean square of the horizontal errors",
              [](const Evaluation& e) { return std::optional(kMm * e.horizontal_m.rms); }},
    KnownGate{"bias_mm", "mm", "of stations; needs a truth and stations with two fixes or more",
              [](const Evaluation& e) { return of_stations_mm(e, &StationFigures::bias_m); }},
    KnownGate{"scatter_mm", "mm", "within stations; needs the same",
              [](const Evaluation& e) { return of_stations_mm(e, &StationFigures::scatter_m); }},
    KnownGate{"height_rms_mm", "mm", "needs z_m in the truth or the path", height_rms_mm},
    KnownGate{"yaw_rms_deg", "deg", "needs yaw_rad in the truth", yaw_rms_deg},
    KnownGate{"missing", "", "share of the captures without a fix, from 0 to 1",
              [](const Evaluation& e) { return std::optional(e.missing_share()); }},
    KnownGate{"stated_ratio", "", "horizontal errors / stated sd; needs a truth and sd columns",
              [](const Evaluation& e) {
                return e.stated ? std::optional(e.stated->horizontal) : std::nullopt;
              }},
    KnownGate{"limit_ratio", "",
              "horizontal errors / theoretical limit; needs --lamps, --calibration, --noise-px",
              [](const Evaluation& e) {
                return e.limit ? std::optional(e.limit->horizontal) : std::nullopt;
              }},
    KnownGate{"fitted_mean_mm", "mm", "mean distance of the fitted line; needs --line",
              [](const Evaluation& e) { return of_fit_mm(e, &ErrorFigures::mean); }},
    KnownGate{"fitted_p90_mm", "mm", "needs --line",
              [](const Evaluation& e) { return of_fit_mm(e, &ErrorFigures::p90); }},
    KnownGate{"fitted_max_mm", "mm", "needs --line",
              [](const Evaluation& e) { return of_fit_mm(e, &ErrorFigures::max); }},
    KnownGate{"worse_mm", "mm",
              "by how much the mean error is certainly larger than that of --compare (lower end of "
              "the difference's interval): 0 fails on the verdict 'worse'; of fewer "
              "than 20 stations or captures nothing is certain",
              worse_mm},
};

}  // namespace

std::span<const KnownGate> known_gates() { return kKnown; }

}  // namespace vlp
