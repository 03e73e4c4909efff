// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/initial_board_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "calibration/intrinsics/view_pose.h"
#include "geometry/median.h"

namespace vlp {
namespace {

/// Returns at most 12 evenly spaced views, which suffice to rank focal lengths.
IntrinsicsInput select_views(const IntrinsicsInput& input) {
  constexpr std::size_t max_views = 12;
  IntrinsicsInput selected = input;
  const std::size_t count = input.views.size();
  if (count <= max_views) return selected;
  selected.views.clear();
  for (std::size_t i = 0; i < max_views; ++i)
    selected.views.push_back(input.views[i * count / max_views]);
  return selected;
}

}  // namespace

InitialPoses estimate_initial_board_poses(const IntrinsicsInput& input, const Lens& lens) {
  InitialPoses initial_poses;
  for (const auto& corners : input.views) {
    const auto pose = estimate_board_view_pose(corners, lens);
    initial_poses.poses.push_back(pose ? pose->camera_from_board : BoardPose{});
    initial_poses.rms_px.push_back(pose ? pose->rms_px : std::numeric_limits<double>::infinity());
  }
  return initial_poses;
}

Lens make_stereographic_lens(const IntrinsicsInput& input, double focal_px) {
  const auto [width, height] = input.imager_px;
  const std::array parameters{focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
  return Lens(LensModel::stereographic, parameters);
}

std::vector<double> rank_initial_focal_lengths(const IntrinsicsInput& input) {
  const IntrinsicsInput selected = select_views(input);
  std::vector<std::pair<double, double>> tried;
  constexpr int min_half_octaves = -5,
                max_half_octaves = 6;  // relative to the width of the image: 0.18 to 8
  for (int half_octaves = min_half_octaves; half_octaves <= max_half_octaves; ++half_octaves) {
    const double focal_px = input.imager_px[0] * std::exp2(half_octaves / 2.0);
    tried.emplace_back(upper_median(estimate_initial_board_poses(
                                        selected, make_stereographic_lens(input, focal_px))
                                        .rms_px),
                       focal_px);
  }
  std::sort(tried.begin(), tried.end());
  std::vector<double> order;
  order.reserve(tried.size());
  for (const auto& [rms_px, focal_px] : tried) order.push_back(focal_px);
  return order;
}

}  // namespace vlp
