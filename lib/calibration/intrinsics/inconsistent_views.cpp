// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/inconsistent_views.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/median.h"

namespace vlp {
namespace {

/// Ratio to the median residual of the typical view.
constexpr double kMinResidualRatio = 3;
/// Fraction of the corners of a view.
constexpr double kMinOutlierFraction = 0.1;
/// Number of images named in a message.
constexpr std::size_t kMaxNames = 12;

/// Fit of the corners of a view.
struct ViewFit {
  double median_px;
  double outlier_fraction;
};

ViewFit measure_view_fit(const BoardProblem& problem, const std::vector<Eigen::Vector2d>& residuals,
                         std::size_t begin, std::size_t end) {
  std::vector<double> sizes_px;
  std::size_t outliers = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double weight = problem.points[i].z();
    if (weight == BoardProblem::kUnseen || !residuals[i].allFinite()) continue;
    sizes_px.push_back(residuals[i].norm());
    if (weight < 0) ++outliers;
  }
  if (sizes_px.empty()) return {0, 0};
  return {upper_median(sizes_px),
          static_cast<double>(outliers) / static_cast<double>(sizes_px.size())};
}

}  // namespace

InconsistentViews test_view_consistency(const IntrinsicsSolution& solution) {
  const BoardProblem& problem = solution.problem;
  const auto residuals = compute_board_residuals(problem);
  const std::size_t points_of_view = problem.points.size() / solution.views.size();
  std::vector<ViewFit> fits;
  std::vector<double> medians_px;
  for (std::size_t i = 0; i < solution.views.size(); ++i) {
    fits.push_back(
        measure_view_fit(problem, residuals, i * points_of_view, (i + 1) * points_of_view));
    medians_px.push_back(fits.back().median_px);
  }
  InconsistentViews found;
  found.typical_px = upper_median(medians_px);
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (fits[i].median_px < kMinResidualRatio * found.typical_px) continue;
    if (fits[i].outlier_fraction < kMinOutlierFraction) continue;
    found.views.push_back(solution.views[i]);
    found.worst_px = std::max(found.worst_px, fits[i].median_px);
  }
  // A single view without a pose may be shaken or misdetected, and is not in the lens.
  if (solution.dropped_views.size() + found.views.size() > 1) {
    for (const auto& dropped : solution.dropped_views) {
      found.views.push_back(dropped.view);
      found.worst_px = std::numeric_limits<double>::infinity();
    }
  }
  std::sort(found.views.begin(), found.views.end());
  const std::size_t all = solution.views.size() + solution.dropped_views.size();
  found.num_other_views = all - found.views.size();
  if (found.views.size() >= found.num_other_views) return {};
  return found;
}

std::string describe_bad_views(const InconsistentViews& found,
                               const std::vector<std::string>& images) {
  std::string names;
  for (std::size_t i = 0; i < std::min(found.views.size(), kMaxNames); ++i) {
    names.append(names.empty() ? "" : ", ").append(images[found.views[i]]);
  }
  if (found.views.size() > kMaxNames) {
    names += fmt::format(" and {} more", found.views.size() - kMaxNames);
  }
  const std::string residuals = std::isfinite(found.worst_px)
                                    ? fmt::format(" (residuals up to {:.2f} px, the others {:.2f})",
                                                  found.worst_px, found.typical_px)
                                    : "";
  const bool is_one = found.views.size() == 1;
  // [FILE-9] `taken by another camera?` | residuals three times those of the other images, or no
  //   pose | remove these images
  return fmt::format("{} board image{} not fit the other {}: {}{}; {} taken by another camera?",
                     found.views.size(), is_one ? " does" : "s do", found.num_other_views, names,
                     residuals, is_one ? "was it" : "were they");
}

}  // namespace vlp
