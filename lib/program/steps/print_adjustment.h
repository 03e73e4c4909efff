// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/adjustment/adjustment.h"
#include "rig/calibration.h"

namespace vlp {

/// What captures that were solved together say, on stdout: tilt, lever arm, lens, known places,
/// lamps. `before` is the calibration that the search started from; `lens_stated` whether a
/// covariance of its lens is known.
void print_adjustment(const AdjustmentResult& found, const Calibration& before, bool lens_stated);

}  // namespace vlp
