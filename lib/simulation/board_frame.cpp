// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/board_layout.h"
#include "simulation/coverage.h"
#include "simulation/frame_renderer.h"
#include "simulation/smear.h"

namespace vlp {
namespace {

/// Points all over the board, for the smear.
std::vector<Eigen::Vector3d> points_on(const Board& board) {
  std::vector<Eigen::Vector3d> points_m;
  if (board.has_squares()) {
    for (const Eigen::Vector2d& at_m : square_corners_m(board)) {
      points_m.emplace_back(at_m.x(), at_m.y(), 0);
    }
    return points_m;
  }
  for (const BoardTag& tag : board_layout(board)) {
    points_m.emplace_back(tag.corners_m[0].x(), tag.corners_m[0].y(), 0);
    points_m.emplace_back(tag.corners_m[2].x(), tag.corners_m[2].y(), 0);
  }
  return points_m;
}

}  // namespace

cv::Mat1f FrameRenderer::board_electrons(const BoardShot& shot) const {
  Shutter part = shutter(shot.exposure_s);
  if (!shot.velocity_in_camera_m_per_s.isZero(0)) {
    const auto pose = [&](double time_s) { return shot.camera_from_board(time_s); };
    part.count =
        parts_of_exposure(moved_px(points_on(scene_.board->print), pose, shot.exposure_s, rays_));
  }
  cv::Mat1f image = rays_.image(static_cast<float>(scene_.board->surround_e_per_s));
  for (; part.index < part.count; ++part.index) {
    const auto board_from_camera = [&](int line) {
      return shot.camera_from_board(part.middle_s(line)).inverse();
    };
    add_shape(rays_, whole_window(rays_), board_from_camera, *print_, 1.0 / part.count, image);
  }
  blur(image, scene_.optics.blur_px);
  return collected(image, shot.exposure_s);
}

}  // namespace vlp
