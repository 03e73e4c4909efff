// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace vlp {

/// Lamp in an image: its approximate position in the level plane at height 1, and its position in
/// the map. `height_beyond_first_m` is its distance behind the first lamp of the map, seen from the
/// camera; `center_sd_m` the standard deviation of its center per axis, in meters at the lamp.
struct LampInPlane {
  Eigen::Vector2d position_in_plane, position_m;
  double height_beyond_first_m, center_sd_m;
};

/// Radius of a lamp, measured in the level plane at height 1 (dimensionless) and given in the map
/// (m). `height_beyond_first_m` as in LampInPlane.
struct LampRadius {
  double radius_in_plane, radius_m, height_beyond_first_m;
};

/// Ratio of the level plane and the room: 1 / height of the first lamp of the map above the camera,
/// or below it, as logarithm of 1/m, and the standard deviation of the logarithm.
struct InverseHeight {
  double log_value, log_sd;

  /// Returns the radius in the plane of a lamp of `radius_m`.
  double compute_radius_in_plane(double radius_m, double height_beyond_first_m) const;
};

/// Estimates the inverse height from the distances between lamps. With the height h of the first
/// lamp and the heights z of two lamps beyond it,
///
///     |p_i (h + z_i) - p_j (h + z_j)| = |x_i - x_j|,
///
/// with the positions p in the plane and x in the map. The result is the median over all pairs,
/// weighted by the ratio of distance and standard deviation. Returns std::nullopt if no pair has a
/// relative standard deviation of at most 20 %.
std::optional<InverseHeight> estimate_inverse_height(const std::vector<LampInPlane>& lamps);

/// Estimates the inverse height from the radii of lamps, as their median. Its standard deviation
/// is the scatter of a single radius, and at least 0.5 %. Returns std::nullopt for fewer than
/// three lamps.
std::optional<InverseHeight> fit_inverse_height(const std::vector<LampRadius>& radii);

}  // namespace vlp
