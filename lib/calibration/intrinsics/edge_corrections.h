// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "camera/lens.h"

namespace vlp {

/// Corrects the corners of tags in one view for the measured curvature of their edges. Replaces the
/// curvature by that of the lens, which projects straight edges, and moves each corner accordingly.
///
/// @param corners  four corners per tag, in the order of BoardLattice::Corner; pixel and edge
///     curvature are changed
/// @return         largest displacement of a corner, px; 0 if none is corrected
///
/// The lens determines the curvature of an edge a hundred times more accurately than the edge
/// itself. A curvature fitted together with the ends makes the ends uncertain. With pixels all
/// along an edge the middle of a parabola has 9/4 of the variance of a straight line. The errors of
/// both ends are then correlated. The corners of a whole tag are then half as accurate.
///
/// The correction is a linear regression, with the measured curve b(w) and that of the lens l(w):
///   end += (straight line fitted to b - l over the pixels) at the end, outwards.
///
/// A tag is not changed if the curvature of an edge is unknown (touching squares, files without
/// it). It is not changed if the lens does not describe one of its edges. It is also not changed if
/// a corner would move by 25 % of an edge or more.
double correct_curvature(std::vector<BoardLattice::Corner>& corners, const Lens& lens);

/// Displacement of the tag edges in a view inwards, towards the dark, as a function of the pixel:
///   shift = coefficients . (1, x, y, x^2 + y^2),  (x, y) = (pixel - middle) / radius_px,  px.
/// It varies over the view like the illumination if white is overexposed.
struct EdgeDisplacement {
  Eigen::Vector4d coefficients = Eigen::Vector4d::Zero();
  Eigen::Vector2d middle{0, 0};
  double radius_px = 1;

  /// Returns the inward displacement of a tag edge at a pixel of the image, px. Negative: outwards.
  double inward_shift_px(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d x = (pixel - middle) / radius_px;
    return coefficients.dot(Eigen::Vector4d(1, x.x(), x.y(), x.squaredNorm()));
  }
};

/// Variation of the shift within a view: constant, or as in EdgeDisplacement.
enum class DisplacementForm { constant, varying };

/// Estimates the edge shift in each view.
///
/// A tone curve, sharpening or overexposure moves an edge by a fraction of its blur. The cause is
/// that half of the coded level is not half of the light. Isolated tags therefore shrink on all
/// sides. The shift is solved together with the pose of the board, by least squares of
///   measured - projected - shift inward
/// (BoardLattice::Corner). The gaps between the tags determine it.
///
/// Priors of 0.1 px, for corners of 0.05 px, keep the constant term near the median of all views
/// and the other terms near 0. Views with fewer than 12 corners get the median. The shift is 0 if
/// touching squares make the corners, which cannot move.
///
/// Use DisplacementForm::constant as long as the warp of the board is unknown: a varying shift
/// would absorb it.
std::vector<EdgeDisplacement> fit_displacements(
    std::span<const std::vector<BoardLattice::Corner>> views, const Lens& lens,
    DisplacementForm form = DisplacementForm::varying);

/// Moves the edges back by a shift. Returns the mean displacement, px.
double correct_displacement(std::vector<BoardLattice::Corner>& corners,
                            const EdgeDisplacement& shift);

}  // namespace vlp
