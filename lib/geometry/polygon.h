// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace vlp {

/// Computes the area of a polygon from its corners, listed in either direction.
double compute_polygon_area(const std::vector<Eigen::Vector2d>& polygon);

/// Returns true if a point lies inside a polygon or within 1e-8 of an edge, in the unit of the
/// corners. The corners are in either direction; the polygon may be concave. Returns false for
/// fewer than three corners.
///
/// A ray from a point inside crosses an odd number of edges (Shimrat 1962).
bool polygon_contains(const std::vector<Eigen::Vector2d>& polygon, const Eigen::Vector2d& point);

}  // namespace vlp
