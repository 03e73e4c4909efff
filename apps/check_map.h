// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture_options.h"

namespace vlp {

/// Throws InputError of the lamp map when the captures, seen by this calibration, say what is wrong
/// with it (calibration/levelling/map_doubt.h).
void check_map(const CaptureInput& input, const Calibration& calibration,
               const DetectOptions& options);

/// The same for an answer that was not found, also when most captures contradict the map in no
/// particular way.
void check_map_of_failure(const CaptureInput& input, const Calibration& calibration,
                          const DetectOptions& options);

}  // namespace vlp
