// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/proposed_gates.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "evaluation/evaluation.h"

namespace vlp {
namespace {

/// 99.9 % and 97.5 % quantiles of the standard normal distribution.
constexpr double kNormalQuantile999 = 3.0902, kNormalQuantile975 = 1.96;
/// Smallest margin, relative to the value, and in mm or degrees.
constexpr double kMinRelativeMargin = 0.01, kMinMargin = 0.001;

double round_up(double value) {
  constexpr double last_digit = 2;  // last of three significant digits
  constexpr double numeric_tolerance = 1e-9;
  const double step = std::pow(10, std::floor(std::log10(value)) - last_digit);
  return step * std::ceil(value / step - numeric_tolerance);
}

double propose_limit(double value, const Interval& interval) {
  // The larger half: for quantiles, the interval ends at errors that occurred, so one end may be
  // too near.
  const double half_width = std::max(interval.high - value, value - interval.low);
  const double standard_error = half_width / kNormalQuantile975;
  const double margin = std::max({kNormalQuantile999 * std::numbers::sqrt2 * standard_error,
                                  kMinRelativeMargin * value, kMinMargin});
  return round_up(value + margin);
}

/// Computes the intervals of the absolute values of a part, without errors that lack it.
std::optional<ErrorIntervals> compute_intervals(const std::vector<FixError>& errors,
                                                std::optional<double> FixError::*part,
                                                int threads) {
  auto [sizes, clusters] = collect_component(errors, std::mem_fn(part));
  for (double& size : sizes) size = std::abs(size);
  return bootstrap_intervals(sizes, clusters, threads);
}

}  // namespace

std::vector<Gate> propose_gates(const EvaluationInput& input, const Evaluation& evaluation) {
  std::vector<Gate> gates;
  if (!evaluation.intervals_m) return gates;
  const auto add = [&](const char* name, double value, const Interval& interval, double scale) {
    gates.push_back(
        {name, propose_limit(scale * value, {scale * interval.low, scale * interval.high})});
  };
  constexpr double millimeters = 1e3, degrees = 180 / std::numbers::pi;
  const ErrorIntervals& horizontal_m = *evaluation.intervals_m;
  add("mean_mm", evaluation.horizontal_m.mean, horizontal_m.mean, millimeters);
  if (const auto& p90_m = horizontal_m.p90) {
    add("p90_mm", evaluation.horizontal_m.p90, *p90_m, millimeters);
  }
  const std::vector<FixError> errors = compute_fix_errors(input, input.fixes).errors;
  const auto height_m = compute_intervals(errors, &FixError::height_m, input.threads);
  if (height_m)
    add("height_rms_mm", evaluation.height_m->magnitudes.rms, height_m->rms, millimeters);
  const auto yaw_rad = compute_intervals(errors, &FixError::yaw_rad, input.threads);
  if (yaw_rad) add("yaw_rms_deg", evaluation.yaw_rad->magnitudes.rms, yaw_rad->rms, degrees);
  constexpr double millionth = 1e-6;  // resolution of the written limit
  gates.push_back(
      {"missing_fraction", millionth * std::ceil(evaluation.missing_fix_fraction() / millionth)});
  return gates;
}

std::string format_gates(const std::vector<Gate>& gates, const Evaluation& evaluation) {
  std::string text = fmt::format(
      "# Proposed from {} fixes of {} captures. A run of the same accuracy exceeds the limit of "
      "an\n# error in about 1 of 200 cases (40 reference points; more often with fewer). The limit "
      "of missing_fraction is\n# the fraction of this run.\nformat: vlp-gates/1\ngates:\n",
      evaluation.fixes, evaluation.captures);
  const std::vector<Metric> metrics = collect_metrics(evaluation);
  for (const Gate& gate : gates) {
    text += fmt::format("  {}: {:.6g}  # {:.4g} measured\n", gate.metric, gate.limit,
                        find_metric_value(metrics, gate.metric).value_or(0));
  }
  return text;
}

}  // namespace vlp
