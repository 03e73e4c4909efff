// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "calibration/dispersion/dispersion.h"

namespace vlp {

/// Prints the circles of the fixes before and after the correction, and the errors of camera and
/// world, to stdout.
///
/// @param focal_px  focal lengths of the camera
/// @param captures  number of captures at known places
void print_dispersion(const DispersionFit& fit, const Eigen::Vector2d& focal_px,
                      std::size_t captures);

}  // namespace vlp
