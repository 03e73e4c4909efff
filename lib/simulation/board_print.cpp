// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/board_print.h"

#include <algorithm>
#include <cmath>

#include "rig/board_layout.h"
#include "simulation/board_pattern.h"

namespace vlp {
namespace {

/// Returns the printed rectangles with the paper below them, in printing order: later ones cover
/// earlier ones.
std::vector<Rectangle> make_rectangles(const SceneBoard& board) {
  const double white = board.white_e_per_s - board.surround_e_per_s;
  const double black = board.black_e_per_s - board.surround_e_per_s;
  const double margin_m = board.margin_m + printed_border_m(board.print);
  const Eigen::Vector2d field_m = tag_field_m(board.print);
  std::vector<Rectangle> all;
  all.push_back({-margin_m, -margin_m, field_m.x() + margin_m, field_m.y() + margin_m, white});
  for (const auto& [left_m, top_m, right_m, bottom_m, is_white] : make_board_pattern(board.print)) {
    all.push_back({left_m, top_m, right_m, bottom_m, is_white ? white : black});
  }
  return all;
}

}  // namespace

BoardWarp::BoardWarp(const SceneBoard& board)
    : field_m_(tag_field_m(board.print)), warp_m_(board.warp_m) {}

BoardWarp::Depth BoardWarp::depth(const Eigen::Vector2d& at_m) const {
  constexpr double max_offset = 1.5;  // outside the paper, where the parabola would bend back
  Depth warp{0, {0, 0}};
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const double fraction = 2 * at_m[axis] / field_m_[axis] - 1;
    const double inside = std::clamp(fraction, -max_offset, max_offset);
    warp.depth_m += warp_m_[axis] * (1 - inside * inside);
    if (fraction == inside) warp.slope[axis] = -4 * warp_m_[axis] * inside / field_m_[axis];
  }
  return warp;
}

BoardPattern::BoardPattern(const SceneBoard& board)
    : warp_(board), mosaic_(make_rectangles(board)) {}

Eigen::Vector2d BoardPattern::hit(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const {
  Eigen::Vector2d at_m = plane_hit(origin, direction);
  if (warp_.flat()) return at_m;
  // Newton's method along the ray; converges in two or three steps.
  constexpr double tolerance_m = 1e-9;
  double distance = -origin.z() / direction.z();
  for (int step = 0; step < 8; ++step) {
    const auto [depth_m, slope] = warp_.depth(at_m);
    const double missed_m = origin.z() + distance * direction.z() - depth_m;
    if (!(std::abs(missed_m) > tolerance_m)) break;
    distance -= missed_m / (direction.z() - slope.dot(direction.head<2>()));
    at_m = origin.head<2>() + distance * direction.head<2>();
  }
  return at_m;
}

}  // namespace vlp
