// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluation_metrics.h"

#include "geometry/angles.h"

namespace vlp {
namespace {

/// Returns the lower end of the difference's interval, negative if the fixes may be better. Returns
/// 0 for too few clusters, and for a positive difference too small to matter.
double compute_worsening_m(const Comparison& comparison) {
  if (comparison.too_few()) return 0;
  const double low_m = comparison.interval_m->low;
  return low_m > 0 && low_m <= comparison.min_relevant_m ? 0 : low_m;
}

}  // namespace

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
  if (const auto& stations = evaluation.stations) {
    add_mm("bias_mm", stations->bias_m);
    add_mm("repeatability_mm", stations->scatter_m);
  }
  if (evaluation.height_m) add_mm("height_rms_mm", evaluation.height_m->sizes.rms);
  if (evaluation.yaw_rad) add("yaw_rms_deg", deg_from_rad(evaluation.yaw_rad->sizes.rms));
  add("missing_fraction", evaluation.missing_fraction());
  if (evaluation.normalized_errors)
    add("normalized_error_rms", evaluation.normalized_errors->horizontal);
  if (evaluation.limit) add("crlb_ratio", evaluation.limit->horizontal);
  if (const auto& fit = evaluation.fit) {
    add_mm("fitted_mean_mm", fit->distances_m.mean);
    add_mm("fitted_p90_mm", fit->distances_m.p90);
    add_mm("fitted_max_mm", fit->distances_m.max);
  }
  if (const auto& comparison = evaluation.comparison; comparison && comparison->pairs > 0) {
    add_mm("worse_mm", compute_worsening_m(*comparison));
  }
  return metrics;
}

}  // namespace vlp
