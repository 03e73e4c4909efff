// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "rig/lamp_map.h"

namespace vlp {

/// Detections of one capture, projected onto the ceiling with an approximate camera pose.
struct CeilingView {
  /// Horizontal position of a detected lamp projected onto the ceiling, in the world frame, m, and
  /// height of the lamp above the camera, m. `lamp` is its id.
  struct ProjectedLamp {
    int lamp;
    Eigen::Vector2d projected_m;
    double above_camera_m;
  };
  /// Horizontal position of the camera in the world.
  Eigen::Vector2d camera_m;
  /// Projected detections; each lamp occurs at most once.
  std::vector<ProjectedLamp> lamps;
  /// Rotation about the vertical from the level camera to the world; required for an unknown tilt.
  double yaw_rad = 0;
};

/// Displacement of one lamp: its position according to the other lamps minus its position in the
/// map, horizontal, in the world. If a single lamp moved by d, its displacement is d.
struct LampOffset {
  int lamp;
  /// Number of captures that contribute to the displacement.
  int captures;
  Eigen::Vector2d map_m, offset_m, sd_m;
};

/// Joint estimate of the displacements of all lamps.
struct LampDisplacements {
  std::vector<int> lamps;
  std::vector<Eigen::Vector2d> map_m;
  /// Number of captures per lamp that contribute.
  std::vector<int> captures;
  /// Residuals of the detections rejected as outliers, by lamp. Includes lamps that are absent from
  /// `lamps` because too few of their detections are left.
  std::map<int, std::vector<double>> outliers_m = {};
  /// Displacement (x, y) of each lamp in the world, two rows per lamp, in the order of `lamps`.
  Eigen::VectorXd displacement_m;
  /// Covariance of the displacements; projector onto the displacements that are no similarity of
  /// the map.
  Eigen::MatrixXd covariance_m2, projector;
  /// Matrix N: the squared residuals of all captures for lamps at p are p' N p, two rows per lamp.
  /// Independent of the map.
  Eigen::MatrixXd information;
  /// Rotation about x and y of the level frame, as the displacement (a, b) of a point straight up.
  Eigen::Vector2d tilt{0, 0};
  /// Residuals of each view on the ceiling, two rows per detection in the order of
  /// CeilingView::lamps.
  std::vector<Eigen::VectorXd> residuals_m = {};
  double degrees_of_freedom = 0;
  /// Height of a lamp above the camera, in the first capture.
  double height_m = 0;
  /// Fraction of the detections that is not rejected as outliers.
  double inlier_fraction = 1;

  /// Returns the displaced position of a lamp, up to a similarity of all lamps.
  Eigen::Vector2d displaced_lamp_position_m(std::size_t lamp) const {
    return map_m[lamp] + displacement_m.segment<2>(2 * static_cast<Eigen::Index>(lamp));
  }
};

/// Estimates the displacements x of all lamps from all captures c:
///   sum over c |seen_c - map_c - x_c + B_c t - A_c y_c|^2 -> min,   G' x = 0
///   y_c  position, yaw and height of the camera, free in each capture
///   A_c  derivative of seen_c with respect to y_c
///   t    tilt common to all captures, only with `tilt_is_free`; B_c its derivative
///   G    similarities of the floor plan, which captures cannot determine
/// Rejects outliers beyond 6 standard deviations, such as misidentified lamps. The covariance is
/// scaled by the residuals.
///
/// Uses lamps that at least two captures contain together with at least two other lamps. Returns
/// std::nullopt if captures do not tie all these lamps together or if there is no redundancy.
/// @pre the lamps have about the same height
std::optional<LampDisplacements> estimate_lamp_displacements(const LampMap& map,
                                                             std::vector<CeilingView> views,
                                                             bool tilt_is_free = false);

/// Returns the offset of a lamp after the similarity that maps the lamps without `excluded` to the
/// map. Returns std::nullopt if there is no such similarity.
std::optional<Eigen::Vector2d> compute_lamp_offset_relative_to_others(
    const LampDisplacements& found, std::size_t lamp, const std::vector<std::size_t>& excluded);

/// Computes the offset of each lamp from the similarity that fits the other lamps best. Omits lamps
/// whose offset the other lamps do not determine.
std::vector<LampOffset> compute_lamp_offsets_relative_to_others(const LampDisplacements& found);

}  // namespace vlp
