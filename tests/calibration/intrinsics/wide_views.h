// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {

/// Image size of wide_lens(), a lens of 190 degrees, px.
inline constexpr std::array kWideImager{1000, 1000};

inline Lens wide_lens() {
  return {LensModel::fisheye, std::array{290.0, 291.0, 501.0, 498.0, 0.03, -0.012, 0.004, -0.0006}};
}

/// Positions of the boards, and largest angle off the axis of the lens.
struct WideBoards {
  double nearest_m = 0.12, farthest_m = 0.3, reach_rad = std::numbers::pi;
  /// Distributes the boards evenly over the image instead of over the angle off the axis.
  bool all_over = false;
};

inline SyntheticViews wide_views(bool kalibr, const Eigen::Vector2d& warp_m = {0, 0}) {
  SyntheticViews views{synthetic_board(kalibr), wide_lens(), kWideImager};
  views.warp_m = warp_m;
  return views;
}

/// Returns the board at a random position up to 85 degrees off the axis, its outer tags beyond 90;
/// often with too few tags.
inline BoardDetection wide_view(const SyntheticViews& views, Random& random, double noise_px,
                                const WideBoards& boards = {}) {
  const double share = random.uniform(0, 1);
  const double off_axis = 1.5 * (boards.all_over ? std::sqrt(share) : share);
  const double around = random.uniform(-3.14, 3.14);
  const double lean = random.uniform(-0.6, 0.6), lean_y = random.uniform(-0.6, 0.6);
  const double roll = random.uniform(-3.14, 3.14);
  const double distance_m = random.uniform(boards.nearest_m, boards.farthest_m);
  const Eigen::Matrix3d towards =
      Eigen::AngleAxisd(around, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      Eigen::AngleAxisd(off_axis, Eigen::Vector3d::UnitY());
  const Eigen::Matrix3d rotation =
      towards * Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitX()).toRotationMatrix() *
      Eigen::AngleAxisd(lean_y, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ());
  BoardDetection seen = views.view(rotation, distance_m * towards.col(2), random, noise_px);
  std::erase_if(seen.tags, [&](const TagDetection& tag) {
    return std::ranges::any_of(tag.corners_px, [&](const Eigen::Vector2d& pixel) {
      const auto ray = views.lens.unproject_pixel(pixel);
      return !ray || std::acos(ray->direction.normalized().z()) > boards.reach_rad;
    });
  });
  return seen;
}

inline bool has_enough_tags(const BoardDetection& seen, const BoardLattice& lattice) {
  return seen.tags.size() > 5 && lattice.can_determine_pose(seen);
}

inline IntrinsicsInput wide_input(bool kalibr, int count, Random& random, double noise_px,
                                  const Eigen::Vector2d& warp_m = {0, 0},
                                  const WideBoards& boards = {}) {
  const SyntheticViews views = wide_views(kalibr, warp_m);
  IntrinsicsInput input{BoardLattice(views.board), {}, kWideImager, LensModel::fisheye};
  while (static_cast<int>(input.views.size()) < count) {
    const BoardDetection seen = wide_view(views, random, noise_px, boards);
    if (has_enough_tags(seen, input.lattice))
      input.views.push_back(input.lattice.list_corners(seen));
  }
  return input;
}

/// Computes the difference from wide_lens() over the pixels up to `degrees` off the axis.
inline ProjectionDifference up_to(double degrees, const Lens& found) {
  const auto difference =
      compare_projections(wide_lens(), found, kWideImager, [&](const auto& pixel) {
        const auto ray = wide_lens().unproject_pixel(pixel);
        const double cosine = ray ? ray->direction.normalized().z() : -1;
        return cosine > std::cos(degrees * std::numbers::pi / 180) ? 1.0 : INFINITY;
      });
  return difference.value();
}

}  // namespace vlp
