// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "simulation/mosaic.h"
#include "simulation/scene.h"

namespace vlp {

/// Deflection of a warped board along z of the board frame (SceneBoard::warp_m).
class BoardBend {
 public:
  explicit BoardBend(const SceneBoard& board);

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

/// Printed board, warped or flat, for add_shape_in_halves(). Values are radiances minus that of the
/// surroundings.
class BoardPrint {
 public:
  /// @throws std::invalid_argument if the board cannot be printed, see tag_pattern()
  explicit BoardPrint(const SceneBoard& board);

  /// Returns (x, y) of the intersection of a ray with the board, in the board frame; NaN if there
  /// is none.
  Eigen::Vector2d hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  double edge_integral(const Eigen::Vector2d& p, const Eigen::Vector2d& q) const {
    return mosaic_.edge_integral(p, q);
  }
  std::optional<double> even_value(const std::array<Eigen::Vector2d, 4>& corners) const {
    return mosaic_.even_value(corners);
  }

 private:
  BoardBend bend_;
  Mosaic mosaic_;
};

}  // namespace vlp
