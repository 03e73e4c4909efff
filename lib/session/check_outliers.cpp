// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/check_outliers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "geometry/median.h"

namespace vlp {
namespace {

/// Fewer errors do not show what is typical of them.
constexpr std::size_t kMinErrors = 5;
/// Ratio to the median error.
constexpr double kMinRatio = 8;
constexpr double kMmPerM = 1e3;

/// Returns names of images with runs of successive captures joined: "0000.png to 0004.png,
/// 0010.png". A capture without an error ends a run.
std::string join_images(const std::vector<CheckError>& errors,
                        const std::vector<std::size_t>& indices) {
  constexpr std::size_t max_groups = 5;
  std::vector<std::string> groups;
  for (std::size_t begin = 0; begin < indices.size();) {
    std::size_t end = begin + 1;
    const auto capture = [&](std::size_t i) { return errors[indices[i]].capture; };
    while (end < indices.size() && capture(end) == capture(end - 1) + 1) ++end;
    groups.push_back(errors[indices[begin]].image);
    if (end > begin + 1) {
      groups.back().append(end > begin + 2 ? " to " : ", ").append(errors[indices[end - 1]].image);
    }
    begin = end;
  }
  if (groups.size() <= max_groups) return fmt::format("{}", fmt::join(groups, ", "));
  const std::size_t more = groups.size() - max_groups;
  groups.resize(max_groups);
  return fmt::format("{} and {} more groups", fmt::join(groups, ", "), more);
}

}  // namespace

std::string describe_check_outliers(const std::vector<CheckError>& errors) {
  if (errors.size() < kMinErrors) return "";
  std::vector<double> sizes_m;
  sizes_m.reserve(errors.size());
  for (const CheckError& error : errors) sizes_m.push_back(error.horizontal_m);
  const double limit_m = std::max(kMinOutlierError_m, kMinRatio * upper_median(sizes_m));
  std::vector<std::size_t> outliers;
  std::vector<double> others_m;
  double max_m = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double size_m = errors[i].horizontal_m;
    if (size_m < limit_m) {
      others_m.push_back(size_m);
      continue;
    }
    outliers.push_back(i);
    max_m = std::max(max_m, size_m);
  }
  if (outliers.empty()) return "";
  const double others_median_m = upper_median(others_m);
  if (outliers.size() == 1) {
    return fmt::format(
        "{} was not taken where its table says: it is {:.1f} mm off, others {:.2g} mm",
        errors[outliers.front()].image, kMmPerM * max_m, kMmPerM * others_median_m);
  }
  return fmt::format(
      "captures {} are off by up to {:.1f} mm, the others by {:.2g} mm: taken "
      "elsewhere than their table says, or by another camera",
      join_images(errors, outliers), kMmPerM * max_m, kMmPerM * others_median_m);
}

}  // namespace vlp
