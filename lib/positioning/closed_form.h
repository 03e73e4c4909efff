// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"
#include "known_motion.h"
#include "robot.h"
#include "sighting.h"

namespace vlp {

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
TwoLampPoses compute_two_lamp_poses(const Sighting& first, const Sighting& second);

/// Computes position and yaw from two or more lamps at one height, in closed form. The
/// least-squares similarity p = s + c z gives H = |c|, g = arg c (the method of [19] in Chen and
/// Guan). All lamps have equal weights. Returns std::nullopt if the lamps coincide in the image.
/// @pre the lamps have equal heights; their mean is used
std::optional<Pose> compute_pose_from_coplanar_lamps(std::span<const Sighting> sightings);

/// Result of compute_initial_pose(): pose of the camera, valid if the status is `ok`.
struct InitialPose {
  /// `ok`, or the reason of failure.
  FixStatus status;
  Pose pose;
};

/// Computes a pose from two or more lamps in closed form, exact without noise. Two lamps:
/// compute_two_lamp_poses(). Lamps at one height: the similarity. Otherwise the solutions from the
/// two lamps that are far apart in the image; of these, the one that fits the other lamps best.
InitialPose compute_initial_pose(std::span<const Sighting> sightings);

/// Motion of the camera at the readout time of the lamp's row.
struct MotionAtReadout {
  /// Velocity and yaw rate of the camera's base, along the axes of the camera's level frame.
  KnownMotion motion = {};
  /// Position of the camera relative to the center of rotation (x, y), along the axes of the level
  /// frame.
  Eigen::Vector2d arm_m{0, 0};
  /// Time from the middle of the image to the readout of the row.
  double time_s = 0;
};

/// Computes the position from one lamp if height and yaw are known (eq. 6 solved for s):
///   s = p - e^{jg} (H e^{jwt} z + (e^{jwt} - 1) a + u t)
///   u, w  velocity and yaw rate;   a  arm;   t  time of the readout
/// Returns std::nullopt if the lamp is not above the camera.
std::optional<Pose> compute_pose_at_known_height_and_yaw(const Sighting& sighting,
                                                         const HeightAndYaw& known,
                                                         const MotionAtReadout& readout = {});

/// Returns the covariance of (X, Y, Zs, g), in m and rad, from the pixel noise alone.
/// @pre compute_pose_at_known_height_and_yaw() computed `pose`
Matrix4 compute_one_lamp_fix_covariance_from_pixel_noise(const Sighting& sighting,
                                                         const Pose& pose);

/// Returns the covariance of (X, Y, Zs, g), in m and rad, from the errors of height, yaw and
/// motion.
/// @pre compute_pose_at_known_height_and_yaw() computed `pose`
Matrix4 compute_one_lamp_fix_covariance_from_sensors(const Sighting& sighting, const Pose& pose,
                                                     const HeightAndYaw& known,
                                                     const MotionAtReadout& readout);

/// Returns the derivative of (X, Y, Zs, g), in m and rad, with respect to a small rotation of the
/// level frame, in rad. The columns are the x, y and z axis of the rotation.
/// @pre compute_pose_at_known_height_and_yaw() computed `pose`
Eigen::Matrix<double, 4, 3> compute_one_lamp_fix_jacobian_wrt_level_rotation(
    const Sighting& sighting, const Pose& pose);

}  // namespace vlp
