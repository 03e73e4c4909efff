// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cstddef>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"
#include "rig/board_layout.h"
#include "support/random.h"

namespace vlp {

/// Returns a plain board, or a Kalibr board, of 6 x 5 tags of 20 mm.
inline Board synthetic_board(bool kalibr) {
  return {"tag36h11",
          6,
          5,
          0.02,
          kalibr ? 0.3 : 1.0,
          kalibr ? 2 : 1,
          kalibr,
          0,
          {false, BoardCorner::bottom_left}};
}

/// Uniform standard deviation for compare_projections().
inline double even(const Eigen::Vector2d&) { return 1; }

/// Returns a lens with strong distortion, for 800 x 600 px.
inline Lens synthetic_lens() {
  const std::array parameters{520.0,  521.0,   402.0,  297.0, -0.25, 0.08,
                              0.0002, -0.0001, -0.012, 0.01,  0.002, 0.0001};
  return Lens(LensModel::opencv8, parameters);
}

/// Returns a tag with its edges moved inwards, as by tone curves; its corners are the intersections
/// of the moved lines.
inline TagDetection shrunk(const TagDetection& tag, double shift_px) {
  TagDetection result = tag;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& corner : tag.corners_px) middle += corner / 4;
  for (std::size_t k = 0; k < 4; ++k) {
    Eigen::Matrix2d normals;
    Eigen::Vector2d offsets;
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d& other = tag.corners_px[(k + (i == 0 ? 1 : 3)) % 4];
      const Eigen::Vector2d along = (other - tag.corners_px[k]).normalized();
      Eigen::Vector2d inward(-along.y(), along.x());
      if (inward.dot(middle - tag.corners_px[k]) < 0) inward = -inward;
      normals.row(i) = inward.transpose();
      offsets[i] = inward.dot(tag.corners_px[k]) + shift_px;
    }
    result.corners_px[k] = normals.inverse() * offsets;
  }
  return result;
}

struct SyntheticViews {
  Board board;
  Lens lens;
  std::array<int, 2> imager_px{800, 600};
  /// Warp at the middle of the whole board, as board_warp_m of a report.
  Eigen::Vector2d warp_m{0, 0};
  double tilt_rad = 0.7;
  /// Distance divided by that at which the board fills the image.
  double farthest = 1.8;
  /// Printed width and height divided by the stated ones.
  Eigen::Vector2d stretch{1, 1};

  /// Returns the tags completely in the image of a board at a random pose in front of the camera.
  BoardDetection random_view(Random& random, double noise_px) const {
    const Eigen::Vector2d field_m = compute_tag_field_size_m(board);
    const double fill_m = lens.focal_px().x() * field_m.x() / imager_px[0];
    for (;;) {
      const double azimuth = random.uniform(-3.2, 3.2), tilt = random.uniform(0, tilt_rad);
      const Eigen::Matrix3d rotation =
          Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0)) *
          Eigen::AngleAxisd(random.uniform(-3.2, 3.2), Eigen::Vector3d::UnitZ()).toRotationMatrix();
      const double z_m = fill_m * random.uniform(0.8, farthest);
      const double v = random.uniform(-0.5, 0.5), u = random.uniform(-0.5, 0.5);
      const Eigen::Vector3d middle(u * imager_px[0], v * imager_px[1], lens.focal_px().x());
      const BoardDetection seen = view(rotation, middle * (z_m / middle.z()), random, noise_px);
      if (seen.tags.size() >= 8) return seen;
    }
  }

  /// `rotation`: camera from board; `middle_m`: middle of the board in the camera frame.
  BoardDetection view(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& middle_m,
                      Random& random, double noise_px) const {
    const Eigen::Vector2d field_m = compute_tag_field_size_m(board);
    BoardDetection seen;
    for (const BoardTag& place : list_board_tags(board)) {
      TagDetection tag{place.id, {}};
      bool whole = true;
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Array2d share = 2 * place.corners_m[k].array() / field_m.array() - 1;
        Eigen::Vector3d point;
        point << stretch.cwiseProduct(place.corners_m[k] - field_m / 2),
            warp_m.dot((1 - share.square()).matrix());
        const auto pixel = lens.project_point(rotation * point + middle_m);
        whole = whole && pixel && (pixel->array() > 3).all() && pixel->x() < imager_px[0] - 3 &&
                pixel->y() < imager_px[1] - 3;
        if (!whole) break;
        // Sequential: the order of evaluation of arguments depends on the compiler.
        const double v = random.normal(), u = random.normal();
        tag.corners_px[k] = *pixel + noise_px * Eigen::Vector2d(u, v);
      }
      if (whole) seen.tags.push_back(tag);
    }
    return seen;
  }

  IntrinsicsInput input(int views, Random& random, double noise_px) const {
    IntrinsicsInput input{BoardLattice(board), {}, imager_px, lens.lens_model()};
    while (static_cast<int>(input.views.size()) < views) {
      const BoardDetection seen = random_view(random, noise_px);
      if (input.lattice.can_determine_pose(seen))
        input.views.push_back(input.lattice.list_corners(seen));
    }
    return input;
  }
};

/// Returns views whose edges do not shift, without an estimate of the warp of the board.
inline IntrinsicsInput make_views_without_edge_shifts(const SyntheticViews& views, int count,
                                                      Random& random, double noise_px) {
  IntrinsicsInput input = views.input(count, random, noise_px);
  input.warp = WarpChoice::off;
  for (auto& view : input.views) {
    for (auto& corner : view) corner.d_pixel_d_edge_shift.setZero();
  }
  return input;
}

/// Displaces the corners of a view by `size_px` on each axis, in an alternating pattern that no
/// pose and no lens explains. `cols`: corners of the board in a row.
inline void displace_alternately(std::vector<BoardLattice::Corner>& view, double size_px,
                                 std::size_t cols) {
  for (auto& corner : view) {
    const std::size_t col = corner.point % cols, row = corner.point / cols;
    corner.pixel.x() += (col + row) % 2 == 0 ? size_px : -size_px;
    corner.pixel.y() += col % 2 == 0 ? size_px : -size_px;
  }
}

}  // namespace vlp
