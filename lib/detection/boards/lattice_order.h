// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Renumbers the points of a board's lattice so that x points right and y down on the front of the
/// board. Corner files may count the rows upwards.
///
/// @param points      points of one lattice, PointDetection::index row by row; sorted by the new
///     index
/// @param cols, rows  number of points per row and per column
/// @param has_180_degree_symmetry  true if a rotation of the board by 180 degrees cannot be
///     detected, as for a chessboard
///
/// With `has_180_degree_symmetry` the lattice is also rotated until its rows point to the right in
/// the image: by 180 degrees, or by multiples of 90 degrees if it is square. This may exchange the
/// two ends of the board. Lens and warp do not change, because the warp is the same from both ends.
/// The warp of a square board cannot be determined.
void renumber_lattice(std::vector<PointDetection>& points, int cols, int rows,
                      bool has_180_degree_symmetry);

/// Pixels (u, v) in one image of all points of a board's lattice, row by row. std::nullopt for a
/// point that was not detected.
using LatticePixels = std::vector<std::optional<Eigen::Vector2d>>;

/// Estimates the number of points in a row of the lattice. Returns `stated`, unless another number
/// makes the points of all images lie along their rows twice as evenly.
/// @pre All images show the same lattice.
std::size_t estimate_points_per_row(std::span<const LatticePixels> images, std::size_t stated);

}  // namespace vlp
