// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/edge_bias.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <optional>

namespace vlp {
namespace {

/// Points x with normal.(x - middle) = 0.
struct Line {
  Eigen::Vector2d middle, normal;
};

struct Projector {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation_m;
  const Lens& lens;

  std::optional<Eigen::Vector2d> operator()(const Eigen::Vector3d& in_board_m) const {
    return lens.project(rotation * in_board_m + translation_m);
  }
};

/// The line with the least squared distances from points along the projected edge.
std::optional<Line> fitted_line(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                                const Projector& project) {
  constexpr int count = 16;  // as many as libapriltag takes of an edge
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (int i = 0; i < count; ++i) {
    const double share = (i + 1.0) / (count + 1.0);
    const auto point = project(from_m + share * (to_m - from_m));
    if (!point) return {};
    sum += *point;
    squares += *point * point->transpose();
  }
  const Eigen::Vector2d middle = sum / count;
  const Eigen::Matrix2d spread = squares / count - middle * middle.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  return Line{middle, axes.eigenvectors().col(0)};
}

Eigen::Vector2d crossing(const Line& a, const Line& b) {
  Eigen::Matrix2d normals;
  normals << a.normal.transpose(), b.normal.transpose();
  return normals.inverse() * Eigen::Vector2d(a.normal.dot(a.middle), b.normal.dot(b.middle));
}

}  // namespace

std::vector<Eigen::Vector2d> edge_bias_px(std::span<const BoardLattice::Corner> corners,
                                          const BoardPose& camera_from_board, const Lens& lens) {
  const Eigen::Vector3d& r = camera_from_board.rotation;
  const Projector project{Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix(),
                          camera_from_board.translation_m, lens};
  std::vector<Eigen::Vector2d> bias(corners.size(), Eigen::Vector2d::Zero());
  for (std::size_t tag = 0; tag < corners.size(); tag += 4) {
    std::array<std::optional<Line>, 4> edges;
    for (std::size_t k = 0; k < 4; ++k) {
      edges[k] =
          fitted_line(corners[tag + k].in_board_m, corners[tag + (k + 1) % 4].in_board_m, project);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& before = edges[(k + 3) % 4];
      const auto exact = project(corners[tag + k].in_board_m);
      if (before && edges[k] && exact) bias[tag + k] = crossing(*before, *edges[k]) - *exact;
    }
  }
  return bias;
}

}  // namespace vlp
