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

Inclination turn_over(const Inclination& inclination);
CameraMount turn_over(const CameraMount& mount);
/// Rotates the positions of the lamps. Shapes are unchanged.
LampMap turn_over(LampMap map);
/// Rotates positions and errors of the lamps; the rest refers to the camera.
Calibration turn_over(Calibration calibration);
Sensors turn_over(Sensors sensors);
BodyState turn_over(const BodyState& state);
/// Rotates states and covariances of a fix.
Fix turn_over(Fix fix);
LampProjection turn_over(LampProjection projection);

/// Returns turn_over(value) for a map with lamps below the camera, otherwise the value.
template <typename Value>
Value turn_over_if(bool lamps_below_camera, const Value& value) {
  return lamps_below_camera ? turn_over(value) : value;
}

}  // namespace vlp
