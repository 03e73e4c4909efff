// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>

#include "simulation/scene.h"

namespace vlp {

/// Returns the reflection about a panel's plane, in the world:
///   p -> p - 2 n n'(p - corner), with the unit normal n.
/// It is its own inverse; its linear part has the determinant -1.
Eigen::Isometry3d reflection_about(const Panel& pane);

/// Returns true if light and eye are on one side of the mirror's plane, so that the mirror may show
/// the light.
bool is_before(const Mirror& mirror, const Eigen::Vector3d& light_m, const Eigen::Vector3d& eye_m);

}  // namespace vlp
