// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_fixes.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <tuple>

#include "geometry/angles.h"

namespace vlp {

namespace {

double convert_m_to_mm(double value_m) { return 1e3 * value_m; }

void print_statistic(const char* name, double value_m, const Interval* interval_m) {
  fmt::print("{:10} {:>10.3f} mm", name, convert_m_to_mm(value_m));
  if (interval_m != nullptr) {
    fmt::print("   {:.3f} to {:.3f}", convert_m_to_mm(interval_m->low),
               convert_m_to_mm(interval_m->high));
  }
  fmt::print("\n");
}

void print_horizontal(const Evaluation& evaluation) {
  const ErrorStatistics& statistics = evaluation.horizontal_m;
  const auto& intervals = evaluation.intervals_m;
  fmt::print("\nhorizontal {:>13}", "");
  if (intervals) {
    fmt::print("   95 % interval, of {} {}\n", intervals->clusters, evaluation.resampling_unit);
  } else {
    fmt::print("   too few {} for an interval\n", evaluation.resampling_unit);
  }
  print_statistic("mean", statistics.mean, intervals ? &intervals->mean : nullptr);
  print_statistic("median", statistics.median, intervals ? &intervals->median : nullptr);
  print_statistic("p90", statistics.p90, intervals && intervals->p90 ? &*intervals->p90 : nullptr);
  print_statistic("rms", statistics.rms, intervals ? &intervals->rms : nullptr);
  print_statistic("max", statistics.max, nullptr);
  fmt::print("\nfraction of the fixes, and the error in mm that it does not exceed\n");
  const auto& distribution_m = evaluation.distribution_m;
  const std::initializer_list<std::size_t> percents{10, 25, 50, 68, 75, 90, 95, 99, 100};
  for (const std::size_t percent : percents) fmt::print("{:>8} %", percent);
  fmt::print("\n");
  for (const std::size_t percent : percents) {
    fmt::print("{:>10.3f}", convert_m_to_mm(distribution_m[percent - 1].second));
  }
  fmt::print("\n\n");
}

void print_height_and_yaw(const Evaluation& evaluation) {
  if (const auto& height_m = evaluation.height_m) {
    fmt::print("height      rms {:.3f} mm, max {:.3f} mm, bias {:+.3f} mm\n",
               convert_m_to_mm(height_m->magnitudes.rms), convert_m_to_mm(height_m->magnitudes.max),
               convert_m_to_mm(height_m->bias));
  }
  if (const auto& yaw_rad = evaluation.yaw_rad) {
    fmt::print("yaw         rms {:.4f} deg, max {:.4f} deg, bias {:+.4f} deg\n",
               deg_from_rad(yaw_rad->magnitudes.rms), deg_from_rad(yaw_rad->magnitudes.max),
               deg_from_rad(yaw_rad->bias));
  }
}

void print_bias_and_repeatability(const BiasAndRepeatability& statistics) {
  const auto& stations = statistics.reference_points;
  const auto worst_bias = std::max_element(
      stations.begin(), stations.end(),
      [](const auto& a, const auto& b) { return a.bias_m.norm() < b.bias_m.norm(); });
  const auto worst_sd =
      std::max_element(stations.begin(), stations.end(),
                       [](const auto& a, const auto& b) { return a.sd_m < b.sd_m; });
  fmt::print("ref. points {} with {} fixes: bias {:.3f} mm rms, repeatability {:.3f} mm\n",
             stations.size(), statistics.fixes, convert_m_to_mm(statistics.bias_m),
             convert_m_to_mm(statistics.repeatability_m));
  fmt::print(
      "  worst     bias {:.3f} mm at ({:.3f}, {:.3f}) m; sd {:.3f} mm at ({:.3f}, {:.3f}) m\n",
      convert_m_to_mm(worst_bias->bias_m.norm()), worst_bias->xy_m.x(), worst_bias->xy_m.y(),
      convert_m_to_mm(worst_sd->sd_m), worst_sd->xy_m.x(), worst_sd->xy_m.y());
}

void print_line_fit(const LineFit& fit) {
  const ErrorStatistics& statistics = fit.distances_m;
  fmt::print(
      "line fit    mean {:.3f} mm, median {:.3f}, p90 {:.3f}, rms {:.3f}, max {:.3f}\n"
      "  jitter    {:.3f} mm rms across the fitted line, not included; line rotated by {:+.4f} "
      "deg\n",
      convert_m_to_mm(statistics.mean), convert_m_to_mm(statistics.median),
      convert_m_to_mm(statistics.p90), convert_m_to_mm(statistics.rms),
      convert_m_to_mm(statistics.max), convert_m_to_mm(fit.jitter_m), deg_from_rad(fit.angle_rad));
}

void print_error_ratios(const Evaluation& evaluation) {
  if (const auto& normalized_errors = evaluation.normalized_errors) {
    const auto& [horizontal, fixes, height, yaw] = *normalized_errors;
    std::string ratios = fmt::format("{:.3f}", horizontal.rms);
    std::string fractions = fmt::format("{:.1f} %", 100 * horizontal.within_95);
    const auto add = [&](const char* name, const std::optional<NormalizedError>& error) {
      if (!error) return;
      ratios += fmt::format(", {} {:.3f}", name, error->rms);
      fractions += fmt::format(", {} {:.1f} %", name, 100 * error->within_95);
    };
    add("height", height);
    add("yaw", yaw);
    fmt::print(
        "error / sd  horizontal {} (rms; 1 if the reported sd are correct)\n"
        "within 95 % horizontal {} (errors within 1.96 sd; correlated within one calibration)\n",
        ratios, fractions);
  }
  if (const auto& limit = evaluation.crlb_ratio) {
    fmt::print("limit       {:.3f} mm rms, error / limit {:.3f} ({})\n",
               convert_m_to_mm(limit->crlb_m), limit->horizontal,
               limit->are_errors_below_crlb() ? "below the limit: see the warning"
                                              : "1: optimal for one level image");
  }
}

void print_comparison(const Comparison& comparison) {
  for (std::size_t i = 0; const ComparedQuantity& quantity : list_compared_quantities()) {
    const QuantityComparison& compared = comparison.quantities[i++];
    const double factor = quantity.units_per_si;
    if (compared.pairs == 0 && i > 1) continue;
    fmt::print("{:11} {} {}", i == 1 ? "compared" : "", quantity.name,
               compared.describe_result(quantity));
    if (compared.pairs > 0) {
      fmt::print(": mean differs by {:+.3f}{}{}", factor * compared.mean_difference,
                 *quantity.unit == 0 ? "" : " ", quantity.unit);
    }
    if (const auto& interval = compared.interval) {
      fmt::print(" (95 %: {:+.3f} to {:+.3f})", factor * interval->low, factor * interval->high);
    }
    fmt::print("\n");
  }
  fmt::print(
      "  captures  {} in both: {} with a smaller error, {} with a larger; {} only in the "
      "fixes, {} only in --compare\n",
      comparison.pairs, comparison.horizontal().smaller, comparison.horizontal().larger,
      comparison.only_in_fixes, comparison.only_in_other_fixes);
}

/// Returns the remedy that reduces an error source.
std::string_view get_remedy(std::string_view key) {
  if (key == "motion") return "odometry, or a faster readout";
  if (key == "roll_pitch") return "an inclination sensor, or a camera that is held level";
  if (key == "lens") return "more views of the board, or vlp-adjust, which corrects the lens";
  if (key == "zenith")
    return "more captures of the rotation in place, or vlp-adjust with known positions";
  if (key == "offset") return "more captures at the known position, or vlp-adjust instead";
  if (key == "lamp_map") return "a better survey, or vlp-adjust --refine-map with known positions";
  return "more lamps in view, larger in the image, or the mean of several captures";
}

}  // namespace

void print_fix_summary(const FixSummary& summary) {
  fmt::print("frames      {}\nfixes       {}\n", summary.frames, summary.fixes);
  for (const auto& [status, count] : summary.failures_by_status) {
    fmt::print("  no fix    {} {}\n", count, status);
  }
  if (const auto& typical = summary.statistics) {
    fmt::print("lamps       {:.1f} a fix ({} to {})\n", typical->mean_lamps, typical->min_lamps,
               typical->max_lamps);
    if (const auto& residual_px = typical->median_residual_px) {
      fmt::print("residual    {:.3f} px (median)\n", *residual_px);
    }
  }
  if (const auto& sd = summary.median_sd) {
    fmt::print("sd          {:.2f} mm horizontal, {:.2f} mm height, {:.3f} deg yaw (median)\n",
               1e3 * sd->horizontal_m, 1e3 * sd->height_m, deg_from_rad(sd->yaw_rad));
  }
}

void print_evaluation(const Evaluation& evaluation, const std::vector<CheckedMetric>& gates) {
  fmt::print("captures    {}\nfixes       {}\nmissing     {:.3g} %\n", evaluation.captures,
             evaluation.fixes, 100 * evaluation.missing_fix_fraction());
  for (const auto& [status, count] : evaluation.failures_by_status) {
    fmt::print("  no fix    {} {}\n", count, status);
  }
  print_horizontal(evaluation);
  print_height_and_yaw(evaluation);
  if (evaluation.bias_and_repeatability)
    print_bias_and_repeatability(*evaluation.bias_and_repeatability);
  if (evaluation.line_fit) print_line_fit(*evaluation.line_fit);
  print_error_ratios(evaluation);
  if (evaluation.comparison) print_comparison(*evaluation.comparison);
  if (!gates.empty()) fmt::print("\n");
  for (const CheckedMetric& gate : gates) {
    fmt::print("{:6} gate {:20} {:>10.4g} {:3} {} {:.4g}\n",
               gate.has_passed_gate() ? "met" : "NOT MET", gate.name, gate.value.value(), gate.unit,
               describe_direction(gate.direction), gate.limit.value());
  }
}

void print_floor_budget(const FloorSummary& summary, const FloorLimits& limits, bool is_free) {
  const auto in_view =
      std::count_if(limits.positions.begin(), limits.positions.end(),
                    [](const FloorLimits::Position& place) { return place.lamps > 1; });
  fmt::print("positions   {}, two lamps or more visible at {}{}\n\n", limits.positions.size(),
             in_view, is_free ? fmt::format(", a fix at {}", summary.positions_with_fix) : "");
  fmt::print("{:15} {:>21} {:>21} {:>21}\n", "one sigma", "horizontal (mm)", "height (mm)",
             "yaw (deg)");
  fmt::print("{:15}", "source");
  for (int i = 0; i < 3; ++i) fmt::print(" {:>10} {:>10}", "median", "worst");
  fmt::print("\n");
  const auto print = [](const FloorSummary::Row& row) {
    const auto& [median, worst] = std::tie(row.median, row.worst);
    fmt::print("{:15} {:10.3f} {:10.3f} {:10.3f} {:10.3f} {:10.4f} {:10.4f}\n", row.source.name,
               1e3 * median.horizontal_m, 1e3 * worst.horizontal_m, 1e3 * median.height_m,
               1e3 * worst.height_m, deg_from_rad(median.yaw_rad), deg_from_rad(worst.yaw_rad));
  };
  for (const FloorSummary::Row& row : summary.sources) print(row);
  print(summary.total);
}

void print_largest_source(const FloorSummary& summary) {
  const auto& [name, key] = summary.largest_error_source().source;
  fmt::print("\nimprove     {} first, {:.0f} % of the horizontal variance: {}\n", name,
             100 * summary.largest_error_source().fraction, get_remedy(key));
}

}  // namespace vlp
