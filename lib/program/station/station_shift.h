// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/station/station_run.h"

namespace vlp {

/// Measures units whose ids are scanned or typed, a line each, until `q` or the end of the input
/// (vlp-station run without a camera). The id of the golden unit verifies the station.
///
/// Each unit runs in a separate process of this program on the same terminal. Memory that libraries
/// leak per unit (mrcal 2.2: about 3 MB) is released with the process, and a crash does not end the
/// shift.
void run_shift(StationRunOptions options);

}  // namespace vlp
