// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "simulation/mosaic.h"
#include "simulation/scene.h"

namespace vlp {

/// Deflection of a warped board along z of the board frame (SceneBoard::warp_m).
class BoardWarp {
 public:
  explicit BoardWarp(const SceneBoard& board);

  /// Deflection and its derivatives with respect to x and y.
  struct Depth {
    double depth_m;
    Eigen::Vector2d slope;
  };
  /// Returns the deflection at a point (x, y) of the board, m.
  Depth depth(const Eigen::Vector2d& at_m) const;
  bool flat() const { return warp_m_.isZero(0); }

 private:
  Eigen::Vector2d field_m_, warp_m_;
};

/// Printed board, warped or flat, for add_shape_supersampled(). Values are radiances minus that of
/// the surroundings.
class BoardPattern {
 public:
  /// @throws std::invalid_argument if the board cannot be printed, see make_tag_pattern()
  explicit BoardPattern(const SceneBoard& board);

  /// Returns (x, y) of the intersection of a ray with the board, in the board frame; NaN if there
  /// is none.
  Eigen::Vector2d hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  double integrate_edge(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
    return mosaic_.integrate_edge(p, q);
  }
  std::optional<double> constant_value(const std::array<Eigen::Vector2d, 4>& corners) const {
    return mosaic_.constant_value(corners);
  }

 private:
  BoardWarp warp_;
  Mosaic mosaic_;
};

}  // namespace vlp
