// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "../geometry/frames.h"
#include "robot.h"
#include "sighting.h"

namespace vlp {

/// Position from one lamp when height and yaw are known: s = p - H e^{jg} z (eq. 6 solved for
/// s). Nothing when the lamp is not above the camera.
std::optional<Pose> fix_one_lamp(const Sighting& sighting, const HeightAndYaw& known);

/// Covariance of (X, Y, Zs, g) of that fix for the pixel's noise, the known values taken as exact.
/// Precondition: fix_one_lamp() gave `pose`.
Matrix4 one_lamp_covariance(const Sighting& sighting, const Pose& pose);

/// What a small rotation of the level frame about each of its axes does to (X, Y, Zs, g) of it.
Eigen::Matrix<double, 4, 3> one_lamp_rotation_effect(const Sighting& sighting, const Pose& pose);

}  // namespace vlp
