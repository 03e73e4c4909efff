// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/sample_size_warnings.h"

#include <algorithm>

#include "captures/number_text.h"

namespace vlp {
namespace {

/// Number of clusters from which the interval of p90 is nearly as wide as it should be, see
/// bootstrap_intervals().
constexpr std::size_t kSufficientClusters = 50;

std::string describe_small_sample(std::size_t clusters, const std::string& resampling_unit) {
  return "with only " + std::to_string(clusters) + " " + resampling_unit + " ";
}

}  // namespace

std::string warn_about_missing_fixes(const Evaluation& evaluation,
                                     const std::vector<CheckedMetric>& gates) {
  const std::size_t missing = evaluation.captures - evaluation.fixes;
  const bool has_gate = std::any_of(gates.begin(), gates.end(), [](const CheckedMetric& gate) {
    return gate.name == "missing_fraction";
  });
  if (gates.empty() || missing == 0 || has_gate) return "";
  // [GATE-1] `no gate 'missing_fraction'` | verdict ignores captures without fix | add gate
  //   `missing_fraction`
  return std::to_string(missing) + " of " + std::to_string(evaluation.captures) +
         (missing == 1 ? " captures has" : " captures have") +
         " no fix, and there is no gate 'missing_fraction'";
}

std::string warn_about_crlb(const Evaluation& evaluation) {
  const auto& limit = evaluation.crlb_ratio;
  if (!limit || !limit->are_errors_below_crlb()) return "";
  constexpr int digits = 3;
  // [GATE-3] `limit: either` | less noise than `--noise-px`, or fixes of several images | check
  //   `--noise-px`
  return "the errors are " + format_digits(limit->horizontal, digits) +
         " times the theoretical limit: either the stated pixel noise is too large, or the fixes "
         "use more information than one image of a level camera with completely visible lamps "
         "(other frames, a known height, partly visible lamps, a tilted camera)";
}

std::vector<std::string> warn_about_sample_size(const Evaluation& evaluation) {
  std::vector<std::string> warnings;
  const std::string& resampling_unit = evaluation.resampling_unit;
  if (const auto& intervals = evaluation.intervals_m; !intervals) {
    // [GATE-2] `for intervals`, `too narrow` | fewer than 20 independent captures | measure more
    warnings.push_back("there are too few " + resampling_unit + " with a fix for intervals");
  } else if (intervals->clusters <
             (evaluation.reference == "truth" ? kSufficientClusters : kPathRuns)) {
    warnings.push_back(describe_small_sample(intervals->clusters, resampling_unit) +
                       (intervals->p90 ? "the interval of p90 is somewhat too narrow"
                                       : "p90 has no interval, which needs " +
                                             std::to_string(kMinClustersForP90)));
  }
  if (const auto& comparison = evaluation.comparison;
      comparison && comparison->horizontal().has_too_few_clusters()) {
    // [GATE-2] `is inconclusive`
    warnings.push_back(describe_small_sample(comparison->horizontal().clusters, resampling_unit) +
                       "with a fix in both files the comparison is inconclusive; it needs " +
                       std::to_string(kMinClustersCompared));
  }
  return warnings;
}

}  // namespace vlp
