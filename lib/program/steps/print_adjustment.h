// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/adjustment/adjustment.h"
#include "rig/calibration.h"

namespace vlp {

/// Prints the result of a joint adjustment to stdout: tilt, lever arm, lens, known places, lamps.
///
/// @param before       initial calibration of the adjustment
/// @param lens_stated  true if the covariance of its lens is known
void print_adjustment(const AdjustmentResult& found, const Calibration& before, bool lens_stated);

}  // namespace vlp
