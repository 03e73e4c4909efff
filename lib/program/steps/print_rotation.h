// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/rotation/circle_center.h"
#include "rig/calibration.h"

namespace vlp {

/// Centre, zenith and tilt on stdout, with what they are worth.
void print_center(const RotationCenter& center, const Camera& camera);

/// What a turn on the spot shows, on stdout, and a warning of a lever arm that it does not show.
void print_summary(const RotationFit& fit, const SpotCaptures& spot, const CircleCenters& circles,
                   const Camera& camera);

}  // namespace vlp
