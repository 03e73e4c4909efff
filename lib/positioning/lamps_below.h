// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "positioner.h"

/// Cameras that look down at lamps below them (LampMap::lamps_below_camera).
///
/// Rotated by T = Rx(180 degrees), world and camera are those of a camera below its lamps, which
/// the estimators support. Since T Rz(a) T = Rz(-a), T Ry(a) T = Ry(-a) and T Rx(a) T = Rx(a), T
/// only changes signs: of y, z, yaw, pitch, vy and yaw rate. T is its own inverse.
namespace vlp {

Inclination rotate_upside_down(const Inclination& inclination);
CameraMount rotate_upside_down(const CameraMount& mount);
/// Rotates the positions of the lamps by 180 degrees about the world's x axis. Shapes are
/// unchanged.
LampMap rotate_upside_down(LampMap map);
/// Rotates positions and errors of the lamps; the rest refers to the camera.
Calibration rotate_upside_down(Calibration calibration);
Sensors rotate_upside_down(Sensors sensors);
BodyState rotate_upside_down(const BodyState& state);
/// Rotates states and covariances of a fix.
Fix rotate_upside_down(Fix fix);
LampProjection rotate_upside_down(LampProjection projection);

/// Returns rotate_upside_down(value) for a map with lamps below the camera, otherwise the value.
template <typename Value>
Value rotate_upside_down_if(bool lamps_below_camera, const Value& value) {
  return lamps_below_camera ? rotate_upside_down(value) : value;
}

}  // namespace vlp
