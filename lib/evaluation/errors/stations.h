// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace vlp {

/// Which places are one station: a place belongs to the first station whose first place is within
/// `radius_m` of it, or else begins a station. Numbered from 0 in the order of the places. Time in
/// proportion to the places. Precondition: radius_m > 0.
std::vector<std::size_t> stations_of(std::span<const Eigen::Vector3d> places_m, double radius_m);

}  // namespace vlp
