// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_outliers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/homography.h"

namespace vlp {
namespace {

constexpr std::size_t kNeighbors = 8;

/// Returns the nearest corners on the board, without those in `is_outlier`.
std::vector<std::size_t> find_nearest_corners(const std::vector<BoardLattice::Corner>& corners,
                                              const std::vector<bool>& is_outlier,
                                              std::size_t middle) {
  std::vector<std::pair<double, std::size_t>> away;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (i == middle || is_outlier[i]) continue;
    away.emplace_back((corners[i].in_board_m - corners[middle].in_board_m).squaredNorm(), i);
  }
  const std::size_t count = std::min(kNeighbors, away.size());
  std::partial_sort(away.begin(), away.begin() + static_cast<std::ptrdiff_t>(count), away.end());
  std::vector<std::size_t> nearest;
  for (std::size_t k = 0; k < count; ++k) nearest.push_back(away[k].second);
  return nearest;
}

/// Returns the distance of a corner from its predicted position, relative to the limit; 0 with too
/// few neighbors.
double compute_displacement_ratio(const std::vector<BoardLattice::Corner>& corners,
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

}  // namespace

std::vector<std::size_t> find_corner_outliers(const std::vector<BoardLattice::Corner>& corners) {
  constexpr std::size_t min_corners_per_outlier = 10;  // at most one in ten
  std::vector<bool> is_outlier(corners.size(), false);
  std::vector<std::vector<std::size_t>> nearest(corners.size());
  std::vector<double> ratios(corners.size());
  const auto test_corner = [&](std::size_t i) {
    nearest[i] = find_nearest_corners(corners, is_outlier, i);
    ratios[i] = compute_displacement_ratio(corners, nearest[i], i);
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

}  // namespace vlp
