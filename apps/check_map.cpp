// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "check_map.h"

#include "calibration/levelling/map_doubt.h"
#include "rig/input_error.h"

namespace vlp {

void check_map(const CaptureInput& input, const Calibration& calibration,
               const DetectOptions& options) {
  const std::string doubt = doubt_of_map(input.frames, input.lamps, calibration);
  if (!doubt.empty()) throw InputError(options.lamps, doubt);
}

void check_map_of_failure(const CaptureInput& input, const Calibration& calibration,
                          const DetectOptions& options) {
  check_map(input, calibration, options);
  if (contradicts_map(input.frames, input.lamps, calibration)) {
    throw InputError(options.lamps,
                     "most captures contradict it: is it the map of this room, and the calibration "
                     "this camera's?");
  }
}

}  // namespace vlp
