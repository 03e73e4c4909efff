// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace vlp {

/// Pixels of the points of a board's lattice, row by row; std::nullopt for a missing point.
using LatticePixels = std::vector<std::optional<Eigen::Vector2d>>;

/// Estimates the number of points in a row of the lattice. Returns `stated`, unless another number
/// makes the points of all images lie along their rows twice as evenly.
/// @pre All images show the same lattice.
std::size_t estimate_row_length(std::span<const LatticePixels> images, std::size_t stated);

}  // namespace vlp
