// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace vlp {

/// Groups positions into reference points, by their distance in space.
///
/// @param places_m  positions in the world, m
/// @param radius_m  > 0
/// @return          number of the reference point of each position, from 0 in the order of
///     appearance
///
/// A position belongs to the first reference point whose first position is within `radius_m` of it,
/// or else begins a new one. The time is proportional to the number of positions.
std::vector<std::size_t> group_positions(std::span<const Eigen::Vector3d> places_m,
                                         double radius_m);

}  // namespace vlp
