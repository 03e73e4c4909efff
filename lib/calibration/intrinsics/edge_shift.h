// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "camera/lens.h"

namespace vlp {

/// How far the edges of the tags in a view went inwards, towards the dark, at a pixel:
///   shift = by . (1, x, y, x^2 + y^2),  (x, y) = (pixel - middle) / reach.
/// It changes over the view as the light does, where white is overexposed.
struct EdgeShift {
  Eigen::Vector4d by = Eigen::Vector4d::Zero();
  Eigen::Vector2d middle{0, 0};
  double reach_px = 1;

  double at(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d x = (pixel - middle) / reach_px;
    return by.dot(Eigen::Vector4d(1, x.x(), x.y(), x.squaredNorm()));
  }
};

/// Whether the shift of a view changes over it.
enum class ShiftForm { even, changing };

/// The shift in each view. A tone curve, sharpening or overexposure moves an edge by a share of its
/// blur, because half of the coded level is not half of the light; so isolated tags shrink by that
/// on all sides. Solved for with the pose of the board, by least squares of
///   seen - projected - shift inward
/// (BoardLattice::Corner), which the gaps between the tags determine. A view of few corners goes
/// with the median of the others, and its shift changes little. One that changes over a view
/// would take for itself what a board that is bent shows, as long as that is not known. 0 where the
/// edges cannot move: where touching squares make the corners.
std::vector<EdgeShift> edge_shifts(std::span<const std::vector<BoardLattice::Corner>> views,
                                   const Lens& lens, ShiftForm form = ShiftForm::changing);

/// Moves the edges back; the mean of what they were moved by, in px.
double take_out_shift(std::vector<BoardLattice::Corner>& corners, const EdgeShift& shift);

}  // namespace vlp
