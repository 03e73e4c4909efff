// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/comparison.h"

#include <algorithm>
#include <string>
#include <utility>

#include "captures/name_index.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

/// That every image of `fixes` is in `others`.
void check_images_in(const FromFile<FixRow>& fixes, const FromFile<FixRow>& others) {
  NameIndex images(others.rows.size());
  for (const FixRow& row : others.rows) images.insert(row.image);
  std::size_t strangers = 0;
  const FixRow* first = nullptr;
  for (const FixRow& row : fixes.rows) {
    if (images.find(row.image)) continue;
    ++strangers;
    if (first == nullptr) first = &row;
  }
  if (first == nullptr) return;
  throw InputError(fixes.file, first->line, "image",
                   "'" + first->image + "' is not in " + others.file.string() + "; " +
                       std::to_string(strangers) + " of " + std::to_string(fixes.rows.size()) +
                       " images are not: are both of the same captures?");
}

std::size_t count_different(std::vector<std::size_t> units) {
  std::sort(units.begin(), units.end());
  return static_cast<std::size_t>(std::unique(units.begin(), units.end()) - units.begin());
}

}  // namespace

std::string_view Comparison::verdict() const {
  if (too_few()) return "no evidence";
  if (interval_m && interval_m->high < 0) return "better";
  if (interval_m && interval_m->low > 0) return "worse";
  return "no evidence";
}

Comparison compare(const std::vector<FixRow>& fixes, const std::vector<FixError>& errors,
                   const std::vector<FixRow>& other_fixes,
                   const std::vector<FixError>& other_errors, int threads) {
  NameIndex images(other_errors.size());
  for (const FixError& other : other_errors) images.insert(other_fixes[other.fix].image);
  Comparison comparison;
  std::vector<double> differences_m;
  std::vector<std::size_t> units;
  for (const FixError& error : errors) {
    const auto other = images.find(fixes[error.fix].image);
    if (!other) {
      ++comparison.only_these;
      continue;
    }
    const double difference_m =
        error.horizontal_m.norm() - other_errors[*other].horizontal_m.norm();
    differences_m.push_back(difference_m);
    units.push_back(error.unit);
    comparison.mean_difference_m += difference_m;
    comparison.smaller += difference_m < 0 ? 1 : 0;
    comparison.larger += difference_m > 0 ? 1 : 0;
  }
  comparison.pairs = differences_m.size();
  comparison.only_others = other_errors.size() - comparison.pairs;
  if (comparison.pairs > 0) {
    comparison.mean_difference_m /= static_cast<double>(comparison.pairs);
    const auto intervals = error_intervals(differences_m, units, threads);
    if (intervals) comparison.interval_m = intervals->mean;
    comparison.units = count_different(std::move(units));
  }
  return comparison;
}

void check_same_images(const FromFile<FixRow>& fixes, const FromFile<FixRow>& others) {
  check_images_in(others, fixes);
  check_images_in(fixes, others);
}

}  // namespace vlp
