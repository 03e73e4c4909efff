// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_outliers.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/homography.h"
#include "geometry/robust_scatter.h"

namespace vlp {
namespace {

/// Neighbors that predict a corner; neighbors of the middle of a patch for the noise estimate.
constexpr std::size_t kNeighbors = 8, kPatchNeighbors = 15;

/// Returns the nearest corners on the board, without those in `is_outlier`.
std::vector<std::size_t> list_nearest_corners(const std::vector<BoardLattice::Corner>& corners,
                                              const std::vector<bool>& is_outlier,
                                              std::size_t middle, std::size_t max_count) {
  std::vector<std::pair<double, std::size_t>> away;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i == middle || is_outlier[i]) continue;
    away.emplace_back((corners[i].in_board_m - corners[middle].in_board_m).squaredNorm(), i);
  }
  const std::size_t count = std::min(max_count, away.size());
  std::partial_sort(away.begin(), away.begin() + static_cast<std::ptrdiff_t>(count), away.end());
  std::vector<std::size_t> nearest;
  for (std::size_t k = 0; k < count; ++k) nearest.push_back(away[k].second);
  return nearest;
}

/// Returns the distance of a corner from its predicted position, relative to the limit; 0 with too
/// few neighbors.
double compute_shift_ratio(const std::vector<BoardLattice::Corner>& corners,
                           const std::vector<std::size_t>& nearest, std::size_t middle) {
  constexpr double max_fraction = 0.25, min_px = 3;
  if (nearest.size() < kNeighbors) return 0;
  std::vector<PlanePair> pairs;
  pairs.reserve(nearest.size());
  double step_px = INFINITY;
  for (const std::size_t i : nearest) {
    pairs.push_back({corners[i].in_board_m.head<2>(), corners[i].pixel});
  }
  const Eigen::Matrix3d px_from_board = estimate_homography(pairs);
  const auto predict = [&](const Eigen::Vector3d& at_m) -> Eigen::Vector2d {
    return (px_from_board * at_m.head<2>().homogeneous()).hnormalized();
  };
  const Eigen::Vector2d expected = predict(corners[middle].in_board_m);
  for (const std::size_t i : nearest) {
    step_px = std::min(step_px, (predict(corners[i].in_board_m) - expected).norm());
  }
  const double displacement_px = (corners[middle].pixel - expected).norm();
  return displacement_px / std::max(min_px, max_fraction * step_px);
}

/// Adds the squared residuals of a patch of corners, times their weights: of a homography, minus
/// their cubic polynomial on the board, which is due to the lens. Returns the degrees of freedom.
double add_patch_residuals(const std::vector<BoardLattice::Corner>& corners,
                           const std::vector<std::size_t>& patch,
                           std::vector<double>& squares_px2) {
  constexpr double rank_tolerance = 1e-6;
  std::vector<PlanePair> pairs;
  pairs.reserve(patch.size());
  for (const std::size_t i : patch)
    pairs.push_back({corners[i].in_board_m.head<2>(), corners[i].pixel});
  const Eigen::Matrix3d px_from_board = estimate_homography(pairs);
  const Eigen::Vector2d middle_m = pairs.back().from;
  const double size_m = (pairs.front().from - middle_m).norm();
  const auto rows = static_cast<Eigen::Index>(patch.size());
  Eigen::MatrixX2d residuals_px(rows, 2);
  Eigen::Matrix<double, Eigen::Dynamic, 10> cubic(rows, 10);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto& [from, to] = pairs[static_cast<std::size_t>(i)];
    residuals_px.row(i) = to - (px_from_board * from.homogeneous()).hnormalized();
    const Eigen::Vector2d at = (from - middle_m) / size_m;
    const double x = at.x(), y = at.y();
    cubic.row(i) << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  }
  Eigen::ColPivHouseholderQR<decltype(cubic)> decomposition(cubic);
  decomposition.setThreshold(rank_tolerance);
  residuals_px -= cubic * decomposition.solve(residuals_px);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double weight = corners[patch[static_cast<std::size_t>(i)]].weight;
    squares_px2.push_back(weight * weight * residuals_px.row(i).squaredNorm());
  }
  return 2 * static_cast<double>(rows - decomposition.rank());
}

}  // namespace

std::vector<std::size_t> list_corner_outliers(const std::vector<BoardLattice::Corner>& corners) {
  constexpr std::size_t min_corners_per_outlier = 10;  // at most one in ten
  std::vector<bool> is_outlier(corners.size(), false);
  std::vector<std::vector<std::size_t>> nearest(corners.size());
  std::vector<double> ratios(corners.size());
  const auto test_corner = [&](std::size_t i) {
    nearest[i] = list_nearest_corners(corners, is_outlier, i, kNeighbors);
    ratios[i] = compute_shift_ratio(corners, nearest[i], i);
  };
  for (std::size_t i = 0; i < corners.size(); ++i) test_corner(i);
  std::vector<std::size_t> found;
  while (!corners.empty()) {
    const auto worst =
        static_cast<std::size_t>(std::max_element(ratios.begin(), ratios.end()) - ratios.begin());
    if (ratios[worst] <= 1) break;
    if ((found.size() + 1) * min_corners_per_outlier > corners.size())
      return {};  // another board, or another order
    found.push_back(worst);
    is_outlier[worst] = true;
    ratios[worst] = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto& others = nearest[i];
      if (!is_outlier[i] && std::find(others.begin(), others.end(), worst) != others.end())
        test_corner(i);
    }
  }
  // An outlier may have biased the predictions of its neighbors before it was found itself.
  std::erase_if(found, [&](std::size_t i) {
    test_corner(i);
    is_outlier[i] = ratios[i] > 1;
    return !is_outlier[i];
  });
  std::sort(found.begin(), found.end());
  return found;
}

std::optional<double> estimate_corner_noise_px(
    std::span<const std::vector<BoardLattice::Corner>> views) {
  constexpr std::size_t max_patches_per_view = 200;
  std::vector<double> squares_px2;
  double freedom = 0;
  for (const auto& corners : views) {
    if (corners.size() <= kPatchNeighbors) continue;
    const std::vector<bool> no_outliers(corners.size(), false);
    const std::size_t step = 1 + corners.size() / max_patches_per_view;
    for (std::size_t middle = 0; middle < corners.size(); middle += step) {
      std::vector<std::size_t> patch =
          list_nearest_corners(corners, no_outliers, middle, kPatchNeighbors);
      patch.push_back(middle);
      freedom += add_patch_residuals(corners, patch, squares_px2);
    }
  }
  if (squares_px2.empty()) return std::nullopt;
  return std::sqrt(estimate_variance_2d(std::move(squares_px2), freedom));
}

}  // namespace vlp
