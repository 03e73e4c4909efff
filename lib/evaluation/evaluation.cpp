// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "evaluation/evaluation.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>

#include "evaluation/errors/systematic_errors.h"
#include "geometry/angles.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

constexpr const char* kUnpairedMetric = "unpaired_fraction";

Path make_reference_path(const EvaluationInput& input) {
  if (input.path) return *input.path;
  return {{(*input.line_m)[0], (*input.line_m)[1]}, {}};
}

void add_horizontal(Evaluation& evaluation, const std::vector<FixError>& errors, int threads) {
  auto [sizes_m, clusters] =
      collect_component(errors, [](const FixError& error) { return error.horizontal_m.norm(); });
  evaluation.intervals_m = bootstrap_intervals(sizes_m, clusters, threads);
  evaluation.horizontal_m = summarize_errors(sizes_m);
  evaluation.distribution_m = list_percentiles(std::move(sizes_m));
}

std::optional<SignedErrorStatistics> summarize_part(const std::vector<FixError>& errors,
                                                    std::optional<double> FixError::*part) {
  auto values = collect_component(errors, std::mem_fn(part)).values;
  if (values.empty()) return std::nullopt;
  return summarize_signed_errors(std::move(values));
}

/// Returns the largest of the normalized errors of x and y, height and yaw; 0 if they are unknown.
double compute_max_normalized_error(const std::vector<FixRow>& fixes,
                                    const std::vector<FixError>& errors) {
  const auto ratios = normalize_errors(fixes, errors);
  if (!ratios) return 0;
  return std::max({ratios->horizontal.rms, ratios->height.value_or(NormalizedError{}).rms,
                   ratios->yaw.value_or(NormalizedError{}).rms});
}

/// Throws InputError if the fixes to compare with have no fix, or cannot be of these captures.
void check_other_fixes(const EvaluationInput& input, const std::vector<FixError>& errors,
                       const std::vector<FixError>& other_errors) {
  const FileRows<FixRow>& others = *input.other_fixes;
  if (other_errors.empty()) {
    throw InputError(others.file, "none of its rows has a fix: is it of these captures?");
  }
  if (!input.truth) return;
  constexpr double min_error = 20, min_ratio = 10;
  const double error = compute_max_normalized_error(input.fixes.rows, errors);
  const double other_error = compute_max_normalized_error(others.rows, other_errors);
  if (other_error < std::max(min_error, min_ratio * error)) return;
  throw InputError(others.file, fmt::format("its errors are {:.3g} times the reported sd, those of "
                                            "the fixes {:.3g} times: is it of these captures, in "
                                            "the same units? If the fixes are right, accept them",
                                            other_error, error));
}

void add_comparison(Evaluation& evaluation, const EvaluationInput& input,
                    const std::vector<FixError>& errors) {
  if (!input.truth) check_same_images(input.fixes, *input.other_fixes);
  const FixErrors others = compute_fix_errors(input, *input.other_fixes);
  check_other_fixes(input, errors, others.errors);
  evaluation.comparison = compare_fix_errors(input.fixes.rows, errors, input.other_fixes->rows,
                                             others.errors, input.threads);
}

}  // namespace

FixErrors compute_fix_errors(const EvaluationInput& input, const FileRows<FixRow>& fixes) {
  if (input.truth) return compare_with_truth(fixes, *input.truth, input.reference_point_radius_m);
  return compare_with_path(fixes.rows, make_reference_path(input));
}

Evaluation evaluate_fixes(const EvaluationInput& input) {
  const auto [captures, missing, errors] = compute_fix_errors(input, input.fixes);
  Evaluation evaluation;
  evaluation.reference = input.truth ? "truth" : input.path ? "path" : "line";
  evaluation.captures = captures;
  evaluation.fixes = errors.size();
  evaluation.failures_by_status = missing;
  if (errors.empty()) return evaluation;
  add_horizontal(evaluation, errors, input.threads);
  evaluation.height_m = summarize_part(errors, &FixError::height_m);
  evaluation.yaw_rad = summarize_part(errors, &FixError::yaw_rad);
  evaluation.resampling_unit = "runs of fixes";
  if (input.truth) {
    evaluation.bias_and_repeatability = compute_bias_and_repeatability(errors, input.truth->rows);
    evaluation.resampling_unit =
        evaluation.bias_and_repeatability ? "reference points" : "captures";
    evaluation.systematic_errors = describe_systematic_errors(input.fixes, *input.truth, errors);
    evaluation.normalized_errors = normalize_errors(input.fixes.rows, errors);
  }
  if (input.truth && input.crlb_input) {
    const auto& [lamps, camera, noise_px] = *input.crlb_input;
    evaluation.crlb_ratio =
        compute_crlb_ratio(errors, input.truth->rows, lamps, camera, noise_px, input.threads);
  }
  if (input.line_m) evaluation.line_fit = fit_line_to_fixes(input.fixes.rows, *input.line_m);
  if (input.other_fixes) add_comparison(evaluation, input, errors);
  return evaluation;
}

std::vector<Metric> collect_metrics(const Evaluation& evaluation) {
  std::vector<Metric> metrics;
  const auto add = [&](const char* name, double value) { metrics.push_back({name, value}); };
  const auto add_mm = [&](const char* name, double value_m) { add(name, 1e3 * value_m); };
  const ErrorStatistics& errors_m = evaluation.horizontal_m;
  add_mm("mean_mm", errors_m.mean);
  add_mm("median_mm", errors_m.median);
  add_mm("p90_mm", errors_m.p90);
  add_mm("max_mm", errors_m.max);
  add_mm("rms_mm", errors_m.rms);
  if (const auto& stations = evaluation.bias_and_repeatability) {
    add_mm("bias_mm", stations->bias_m);
    add_mm("repeatability_mm", stations->repeatability_m);
  }
  if (evaluation.height_m) add_mm("height_rms_mm", evaluation.height_m->magnitudes.rms);
  if (evaluation.yaw_rad) add("yaw_rms_deg", deg_from_rad(evaluation.yaw_rad->magnitudes.rms));
  add("missing_fraction", evaluation.missing_fix_fraction());
  if (const auto& ratios = evaluation.normalized_errors) {
    const auto add_ratio = [&](const char* name, const NormalizedError& error) {
      metrics.push_back({name, error.rms, error.low});
    };
    add_ratio("normalized_error_rms", ratios->horizontal);
    if (ratios->height) add_ratio("normalized_height_error_rms", *ratios->height);
    if (ratios->yaw) add_ratio("normalized_yaw_error_rms", *ratios->yaw);
  }
  if (evaluation.crlb_ratio) add("crlb_ratio", evaluation.crlb_ratio->horizontal);
  if (const auto& fit = evaluation.line_fit) {
    add_mm("fitted_mean_mm", fit->distances_m.mean);
    add_mm("fitted_p90_mm", fit->distances_m.p90);
    add_mm("fitted_max_mm", fit->distances_m.max);
  }
  if (const auto& comparison = evaluation.comparison; comparison) {
    for (std::size_t i = 0; const ComparedQuantity& quantity : list_compared_quantities()) {
      const QuantityComparison& compared = comparison->quantities[i++];
      if (compared.pairs > 0) add(quantity.metric, quantity.units_per_si * compared.compute_loss());
    }
    const auto captures = static_cast<double>(std::max<std::size_t>(1, evaluation.captures));
    add(kUnpairedMetric, static_cast<double>(comparison->unpaired) / captures);
  }
  return metrics;
}

std::vector<Gate> make_comparison_gates(const std::vector<Metric>& metrics) {
  std::vector<Gate> gates;
  const auto add = [&](const char* metric) {
    if (find_metric_value(metrics, metric)) gates.push_back({metric, 0});
  };
  for (const ComparedQuantity& quantity : list_compared_quantities()) add(quantity.metric);
  add(kUnpairedMetric);
  return gates;
}

}  // namespace vlp
