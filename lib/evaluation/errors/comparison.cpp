// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/comparison.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "captures/csv_reader.h"
#include "captures/number_text.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

std::size_t count_distinct(std::vector<std::size_t> clusters) {
  std::sort(clusters.begin(), clusters.end());
  return static_cast<std::size_t>(std::unique(clusters.begin(), clusters.end()) - clusters.begin());
}

std::optional<double> compute_horizontal_error(const FixRow&, const FixError& error) {
  return error.horizontal_m.norm();
}

std::optional<double> compute_magnitude(std::optional<double> error) {
  return error ? std::optional(std::abs(*error)) : std::nullopt;
}
std::optional<double> compute_height_error(const FixRow&, const FixError& error) {
  return compute_magnitude(error.height_m);
}
std::optional<double> compute_yaw_error(const FixRow&, const FixError& error) {
  return compute_magnitude(error.yaw_rad);
}

std::optional<double> compute_horizontal_sd(const FixRow& fix, const FixError&) {
  const auto& sd = fix.fix->sd;
  return sd ? std::optional(sd->head<2>().norm()) : std::nullopt;
}

std::optional<double> compute_normalized_error(const FixRow& fix, const FixError& error) {
  const auto& sd = fix.fix->sd;
  if (!sd || !(sd->minCoeff() > 0)) return std::nullopt;
  const Eigen::Vector4d errors{error.horizontal_m.x(), error.horizontal_m.y(),
                               error.height_m.value_or(0), error.yaw_rad.value_or(0)};
  const int known = 2 + (error.height_m ? 1 : 0) + (error.yaw_rad ? 1 : 0);
  return errors.cwiseQuotient(*sd).norm() / std::sqrt(known);
}

constexpr std::array<ComparedQuantity, 5> kComparedQuantities{
    {{"horizontal error", "horizontal", "worse_mm", "mm", 1e3, 1e-6, 0, compute_horizontal_error},
     {"height error", "height", "worse_height_mm", "mm", 1e3, 1e-6, 0, compute_height_error},
     {"yaw error", "yaw", "worse_yaw_deg", "deg", deg_from_rad(1), 1e-6, 0, compute_yaw_error},
     {"horizontal sd", "sd", "worse_sd_mm", "mm", 1e3, 1e-6, 0, compute_horizontal_sd},
     {"error / sd", "normalized_error", "worse_normalized_error", "", 1, 0, 1,
      compute_normalized_error}}};

/// Fix errors of one capture in the two sets.
struct ErrorPair {
  const FixError *error, *other;
};

QuantityComparison compare_quantity(const ComparedQuantity& quantity,
                                    const std::vector<ErrorPair>& pairs,
                                    const std::vector<FixRow>& fixes,
                                    const std::vector<FixRow>& other_fixes, int threads) {
  QuantityComparison comparison;
  std::vector<double> differences;
  std::vector<std::size_t> clusters;
  double sum = 0, others = 0;
  for (const auto& [error, other_error] : pairs) {
    const auto value = quantity.compute(fixes[error->fix], *error);
    const auto other = quantity.compute(other_fixes[other_error->fix], *other_error);
    if (!value || !other) continue;
    const double difference = *value - *other;
    differences.push_back(difference);
    clusters.push_back(error->cluster);
    sum += difference;
    others += *other;
    comparison.smaller += difference < 0 ? 1 : 0;
    comparison.larger += difference > 0 ? 1 : 0;
  }
  comparison.pairs = differences.size();
  comparison.min_relevant = quantity.min_difference;
  if (comparison.pairs == 0) return comparison;
  const auto count = static_cast<double>(comparison.pairs);
  comparison.mean_difference = sum / count;
  comparison.min_relevant =
      std::max({quantity.min_difference, kMinDifferenceFraction * others / count,
                quantity.correct_mean - others / count});
  const auto intervals = bootstrap_intervals(differences, clusters, threads);
  if (intervals) comparison.interval = intervals->mean;
  comparison.clusters = count_distinct(std::move(clusters));
  return comparison;
}

/// Returns true if a quantity is known in one of the fixes only.
bool is_in_one_only(const ErrorPair& pair, const std::vector<FixRow>& fixes,
                    const std::vector<FixRow>& other_fixes) {
  return std::ranges::any_of(kComparedQuantities, [&](const ComparedQuantity& quantity) {
    return quantity.compute(other_fixes[pair.other->fix], *pair.other).has_value() !=
           quantity.compute(fixes[pair.error->fix], *pair.error).has_value();
  });
}

}  // namespace

std::span<const ComparedQuantity, 5> list_compared_quantities() { return kComparedQuantities; }

std::string_view QuantityComparison::comparison_verdict() const {
  if (has_too_few_clusters() || !interval) return "inconclusive";
  if (interval->high < -min_relevant) return "better";
  if (interval->low > min_relevant) return "worse";
  const bool within = interval->low >= -min_relevant && interval->high <= min_relevant;
  return within ? "equivalent" : "inconclusive";
}

double QuantityComparison::compute_loss() const {
  if (has_too_few_clusters() || !interval) return 0;
  return interval->low > 0 && interval->low <= min_relevant ? 0 : interval->low;
}

std::string QuantityComparison::describe_result(const ComparedQuantity& quantity) const {
  constexpr int digits = 2;
  const std::string unit = quantity.unit;
  const std::string threshold = format_digits(quantity.units_per_si * min_relevant, digits) +
                                (unit.empty() ? "" : " ") + unit;
  std::string words(comparison_verdict());
  if (words == "equivalent") return words.append(" within ").append(threshold);
  if (words == "inconclusive") return words.append(has_too_few_clusters() ? ", too few" : "");
  return words.append(" by more than ").append(threshold);
}

std::string_view Comparison::comparison_verdict() const {
  for (const std::string_view verdict : {"worse", "better", "inconclusive"}) {
    if (std::ranges::any_of(quantities, [&](const QuantityComparison& quantity) {
          return quantity.pairs > 0 && quantity.comparison_verdict() == verdict;
        }))
      return verdict;
  }
  return horizontal().comparison_verdict();
}

Comparison compare_fix_errors(const std::vector<FixRow>& fixes, const std::vector<FixError>& errors,
                              const std::vector<FixRow>& other_fixes,
                              const std::vector<FixError>& other_errors, int threads) {
  NameIndex other_images(other_fixes.size());
  for (const FixRow& other : other_fixes) other_images.insert_unique_name(other.image);
  std::vector<const FixError*> errors_of_others(other_fixes.size(), nullptr);
  for (const FixError& other : other_errors) errors_of_others[other.fix] = &other;
  Comparison comparison;
  for (const FixRow& fix : fixes) {
    if (!other_images.find_name_index(fix.image)) ++comparison.unpaired;
  }
  std::vector<ErrorPair> pairs;
  for (const FixError& error : errors) {
    const auto other = other_images.find_name_index(fixes[error.fix].image);
    if (!other || errors_of_others[*other] == nullptr) {
      ++comparison.only_in_fixes;
      continue;
    }
    pairs.push_back({&error, errors_of_others[*other]});
    if (is_in_one_only(pairs.back(), fixes, other_fixes)) ++comparison.unpaired;
  }
  comparison.pairs = pairs.size();
  comparison.only_in_other_fixes = other_errors.size() - comparison.pairs;
  comparison.unpaired += comparison.only_in_other_fixes;
  std::ranges::transform(kComparedQuantities, comparison.quantities.begin(),
                         [&](const ComparedQuantity& quantity) {
                           return compare_quantity(quantity, pairs, fixes, other_fixes, threads);
                         });
  return comparison;
}

}  // namespace vlp
