// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/rotation/circle_center.h"
#include "rig/calibration.h"

namespace vlp {

/// Prints center, zenith and tilt with their standard deviations to stdout.
void print_center(const RotationCenter& center, const Camera& camera);

/// Prints the result of a rotation in place to stdout, and a note if the lever arm is not
/// observable.
void print_summary(const RotationFit& fit, const RotationCaptures& spot,
                   const CircleCenters& circles, const Camera& camera);

}  // namespace vlp
