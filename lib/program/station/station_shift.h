// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/station/station_run.h"

namespace vlp {

/// vlp-station run without a camera: units whose ids are scanned or typed, a line each, until `q`
/// or the end of the input; the golden unit's id verifies the station. Each is run by this program
/// in a process of its own, with the same terminal: what libraries keep of a unit (mrcal 2.2 about
/// 3 MB) goes with it, and nothing that becomes of one unit ends the shift.
void run_shift(StationRunOptions options);

}  // namespace vlp
