// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/comparison.h"

#include <algorithm>
#include <string>
#include <utility>

#include "captures/csv_reader.h"
#include "captures/number_text.h"

namespace vlp {
namespace {

std::size_t count_distinct(std::vector<std::size_t> clusters) {
  std::sort(clusters.begin(), clusters.end());
  return static_cast<std::size_t>(std::unique(clusters.begin(), clusters.end()) - clusters.begin());
}

}  // namespace

std::string_view Comparison::comparison_verdict() const {
  if (has_too_few_clusters() || !interval_m) return "inconclusive";
  if (interval_m->high < -min_relevant_m) return "better";
  if (interval_m->low > min_relevant_m) return "worse";
  const bool within = interval_m->low >= -min_relevant_m && interval_m->high <= min_relevant_m;
  return within ? "equivalent" : "inconclusive";
}

std::string Comparison::describe_comparison_result() const {
  constexpr int digits = 2;
  const std::string threshold = format_significant_digits(1e3 * min_relevant_m, digits) + " mm";
  std::string words(comparison_verdict());
  if (words == "equivalent") return words.append(" within ").append(threshold);
  if (words == "inconclusive") return words.append(has_too_few_clusters() ? ", too few" : "");
  return words.append(" by more than ").append(threshold);
}

Comparison compare_horizontal_errors(const std::vector<FixRow>& fixes,
                                     const std::vector<FixError>& errors,
                                     const std::vector<FixRow>& other_fixes,
                                     const std::vector<FixError>& other_errors, int threads) {
  NameIndex images(other_errors.size());
  for (const FixError& other : other_errors)
    images.insert_unique_name(other_fixes[other.fix].image);
  Comparison comparison;
  std::vector<double> differences_m;
  std::vector<std::size_t> clusters;
  double others_m = 0;
  for (const FixError& error : errors) {
    const auto other = images.find_name_index(fixes[error.fix].image);
    if (!other) {
      ++comparison.only_in_fixes;
      continue;
    }
    const double other_m = other_errors[*other].horizontal_m.norm();
    const double difference_m = error.horizontal_m.norm() - other_m;
    others_m += other_m;
    differences_m.push_back(difference_m);
    clusters.push_back(error.cluster);
    comparison.mean_difference_m += difference_m;
    comparison.smaller += difference_m < 0 ? 1 : 0;
    comparison.larger += difference_m > 0 ? 1 : 0;
  }
  comparison.pairs = differences_m.size();
  comparison.only_in_other_fixes = other_errors.size() - comparison.pairs;
  if (comparison.pairs > 0) {
    const auto pairs = static_cast<double>(comparison.pairs);
    comparison.mean_difference_m /= pairs;
    comparison.min_relevant_m =
        std::max(kMinDifference_m, kMinDifferenceFraction * others_m / pairs);
    const auto intervals = bootstrap_error_intervals(differences_m, clusters, threads);
    if (intervals) comparison.interval_m = intervals->mean;
    comparison.clusters = count_distinct(std::move(clusters));
  }
  return comparison;
}

}  // namespace vlp
