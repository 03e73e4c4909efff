// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/check_outliers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

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

/// Returns names of images with runs of successive captures joined: "0000.png to 0004.png,
/// 0010.png". A capture that is not listed ends a run.
std::string join_images(const std::vector<CaptureError>& captures) {
  constexpr std::size_t max_groups = 5;
  std::vector<std::string> groups;
  for (std::size_t begin = 0; begin < captures.size();) {
    std::size_t end = begin + 1;
    while (end < captures.size() && captures[end].capture == captures[end - 1].capture + 1) ++end;
    groups.push_back(captures[begin].image);
    if (end > begin + 1) {
      groups.back().append(end > begin + 2 ? " to " : ", ").append(captures[end - 1].image);
    }
    begin = end;
  }
  if (groups.size() <= max_groups) return fmt::format("{}", fmt::join(groups, ", "));
  const std::size_t more = groups.size() - max_groups;
  groups.resize(max_groups);
  return fmt::format("{} and {} more groups", fmt::join(groups, ", "), more);
}

/// Captures with gross errors, and the errors of all and of the other captures.
struct Outliers {
  std::vector<CaptureError> captures;
  double max = 0;
  std::vector<double> all, others;
};

/// Finds the errors of at least `min_size` and kMinRatio times the median; none among few errors.
Outliers collect_outliers(const std::vector<CaptureError>& errors, double min_size) {
  Outliers found;
  if (errors.size() < kMinErrors) return found;
  for (const CaptureError& error : errors) found.all.push_back(error.size);
  const double limit = std::max(min_size, kMinRatio * upper_median(found.all));
  for (const CaptureError& error : errors) {
    if (error.size < limit) {
      found.others.push_back(error.size);
      continue;
    }
    found.captures.push_back(error);
    found.max = std::max(found.max, error.size);
  }
  return found;
}

}  // namespace

std::string describe_error_outliers(const std::vector<CaptureError>& errors_m) {
  const Outliers outliers = collect_outliers(errors_m, kMinOutlierError_m);
  if (outliers.captures.empty()) return "";
  const double max_mm = kMmPerM * outliers.max, others_mm = kMmPerM * upper_median(outliers.others);
  if (outliers.captures.size() == 1) {
    // [STATION-19] `in its table`, `in their table`
    return fmt::format(
        "{} was not taken at the position in its table: its error is {:.1f} mm, that of others "
        "{:.2g} mm",
        outliers.captures.front().image, max_mm, others_mm);
  }
  return fmt::format(
      "captures {} have errors up to {:.1f} mm, the others {:.2g} mm: taken at other positions "
      "than those in their table, or by another camera",
      join_images(outliers.captures), max_mm, others_mm);
}

std::string describe_residual_outliers(const std::vector<CaptureError>& residuals_px) {
  const Outliers outliers = collect_outliers(residuals_px, kMinResidual_px);
  if (outliers.captures.size() < 2) return "";
  return fmt::format(
      "the lamps in captures {} do not fit lens and tilt of the others (residuals up to {:.2f} px, "
      "typically {:.2g} px): other camera, or covered lamps; repeat these captures",
      join_images(outliers.captures), outliers.max, upper_median(outliers.all));
}

}  // namespace vlp
