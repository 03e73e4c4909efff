// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace vlp {

/// The points of a board's lattice, row by row; nothing where one was not seen.
using LatticePixels = std::vector<std::optional<Eigen::Vector2d>>;

/// How many points a row has: as stated, unless with another number the points of all images
/// together, which are of one lattice, lie along their rows twice as evenly.
std::size_t row_shown(std::span<const LatticePixels> images, std::size_t stated);

}  // namespace vlp
