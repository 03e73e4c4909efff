// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/check_outliers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "geometry/median.h"

namespace vlp {
namespace {

/// Minimum number of errors for a typical value.
constexpr std::size_t kMinErrors = 5;
/// Ratio to the median error.
constexpr double kMinRatio = 8;
constexpr double kMmPerM = 1e3;

/// Smaller residuals are acceptable: stations accept a rotation in place with this average.
constexpr double kMinResidual_px = 0.2;

/// Name of the image and index of the capture in the folder.
using NamedCapture = std::pair<std::string, std::size_t>;

/// Returns names of images with runs of successive captures joined: "0000.png to 0004.png,
/// 0010.png". A capture that is not listed ends a run.
std::string join_images(const std::vector<NamedCapture>& captures) {
  constexpr std::size_t max_groups = 5;
  std::vector<std::string> groups;
  for (std::size_t begin = 0; begin < captures.size();) {
    std::size_t end = begin + 1;
    while (end < captures.size() && captures[end].second == captures[end - 1].second + 1) ++end;
    groups.push_back(captures[begin].first);
    if (end > begin + 1) {
      groups.back().append(end > begin + 2 ? " to " : ", ").append(captures[end - 1].first);
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
  std::vector<NamedCapture> outliers;
  outliers.reserve(errors.size());
  std::vector<double> others_m;
  double max_m = 0;
  for (const CheckError& error : errors) {
    if (error.horizontal_m < limit_m) {
      others_m.push_back(error.horizontal_m);
      continue;
    }
    outliers.emplace_back(error.image, error.capture);
    max_m = std::max(max_m, error.horizontal_m);
  }
  if (outliers.empty()) return "";
  const double others_median_m = upper_median(others_m);
  if (outliers.size() == 1) {
    return fmt::format(
        "{} was not taken where its table says: it is {:.1f} mm off, others {:.2g} mm",
        outliers.front().first, kMmPerM * max_m, kMmPerM * others_median_m);
  }
  return fmt::format(
      "captures {} are off by up to {:.1f} mm, the others by {:.2g} mm: taken "
      "elsewhere than their table says, or by another camera",
      join_images(outliers), kMmPerM * max_m, kMmPerM * others_median_m);
}

std::string describe_residual_outliers(const std::vector<CaptureResidual>& residuals) {
  if (residuals.size() < kMinErrors) return "";
  std::vector<double> sizes_px;
  sizes_px.reserve(residuals.size());
  for (const CaptureResidual& each : residuals) sizes_px.push_back(each.residual_px);
  const double median_px = upper_median(sizes_px);
  const double limit_px = std::max(kMinResidual_px, kMinRatio * median_px);
  std::vector<NamedCapture> outliers;
  outliers.reserve(residuals.size());
  double max_px = 0;
  for (const CaptureResidual& each : residuals) {
    if (each.residual_px < limit_px) continue;
    outliers.emplace_back(each.image, each.capture);
    max_px = std::max(max_px, each.residual_px);
  }
  if (outliers.size() < 2) return "";
  return fmt::format(
      "the lamps in captures {} do not fit lens and tilt of the others (residuals up to {:.2f} px, "
      "typically {:.2g} px): of another camera, or with covered lamps; take them again",
      join_images(outliers), max_px, median_px);
}

}  // namespace vlp
