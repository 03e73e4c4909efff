// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"

/// The positioning equation (Chen and Guan, eq. 1, 3, 6, 7). A level camera is at S = (X, Y, Zs)
/// with yaw g. It observes a lamp at P = (p, Z) at the normalized point z = (x/z, y/z) of its level
/// frame. With points of the floor plane as complex numbers, s = X + jY and H = Z - Zs:
///   p = s + H e^{jg} z      so      z = e^{-jg} (p - s) / H.
namespace vlp {

/// Observation of a lamp of the map by a level camera.
struct Sighting {
  /// Position P of the lamp in the world, m.
  Eigen::Vector3d lamp_m;
  /// Measured point z = (x/z, y/z) in the level frame of the camera.
  Eigen::Vector2d z;
};

/// Poses of a level camera that explain two lamps exactly: `count` of them, 0 to 2, at the
/// beginning of `poses`.
struct TwoLampPoses {
  int count = 0;
  std::array<Pose, 2> poses;
  /// True if there is no pose, but one would exist with a lamp at or below the height of the
  /// camera.
  bool lamp_below_camera = false;
};

/// Computes position and yaw from two lamps in closed form. Let D = p_2 - p_1, h = Z_2 - Z_1 and H
/// = Z_1 - Zs. The positioning equation gives D = e^{jg} (H (z_2 - z_1) + h z_2), so
///   |z_2 - z_1|^2 H^2 + 2 h Re(conj(z_2 - z_1) z_2) H + h^2 |z_2|^2 - |D|^2 = 0.
/// At equal heights (h = 0): H = |D| / |z_2 - z_1|, g = arg(D / (z_2 - z_1)), eq. 5 with eq. 7.
///
/// Lamps at different heights have two solutions if both are far from the image center and close
/// together (|h z_2| > |D|); otherwise one. Returns none if the lamps coincide in the image.
TwoLampPoses solve_for_two_lamps(const Sighting& first, const Sighting& second);

/// Computes position and yaw from two or more lamps at one height, in closed form. The
/// least-squares similarity p = s + c z gives H = |c|, g = arg c (the method of [19] in Chen and
/// Guan). All lamps have equal weights. Returns std::nullopt if the lamps coincide in the image.
/// @pre the lamps have equal heights; their mean is used
std::optional<Pose> solve_for_coplanar_lamps(std::span<const Sighting> sightings);

/// Poses of a camera that are initial values for least squares: `count` of them at the beginning of
/// `poses`.
struct InitialLevelPoses {
  /// `ok`, or the reason why there are none.
  FixStatus status;
  int count = 0;
  std::array<Pose, 2> poses = {};
};

/// Computes the poses from two or more lamps in closed form, exact without noise. Two lamps:
/// solve_for_two_lamps(). Lamps at one height: the similarity. Otherwise the solutions from the
/// two lamps that are far apart in the image.
InitialLevelPoses compute_initial_poses(std::span<const Sighting> sightings);

/// Computes the position from one lamp if height and yaw are known (eq. 6 solved for s):
///   s = p - H e^{jg} z
/// Returns std::nullopt if the lamp is not above the camera.
std::optional<Pose> solve_for_one_lamp(const Sighting& sighting, double z_m, double yaw_rad);

}  // namespace vlp
