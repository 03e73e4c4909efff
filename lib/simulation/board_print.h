// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "simulation/mosaic.h"
#include "simulation/scene.h"

namespace vlp {

/// How far a bent board is from flat, along z of the board frame (SceneBoard::warp_m).
class BoardBend {
 public:
  explicit BoardBend(const SceneBoard& board);

  struct Depth {
    double depth_m;
    Eigen::Vector2d slope;
  };
  Depth depth(const Eigen::Vector2d& at_m) const;
  bool flat() const { return warp_m_.isZero(0); }

 private:
  Eigen::Vector2d field_m_, warp_m_;
};

/// A printed and possibly bent board, drawn as what it adds to its surroundings.
class BoardPrint {
 public:
  /// Throws std::invalid_argument when the board cannot be printed: see tag_pattern().
  explicit BoardPrint(const SceneBoard& board);

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
