// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "frontend/observation.h"
#include "session/step_result.h"

namespace vlp {

/// Returns the rejected images with their reasons. Names include the folder if there are several
/// folders. Rejected frames of a video are combined to one entry per reason, with their number.
std::vector<SkippedImage> skipped_images(const std::vector<Observation>& images);

/// Adds the remarks of an intake to the result of a step: skipped images, warnings, notes, details.
/// Fails the step if no image can be used.
void add_remarks(const Observations& seen, StepResult& result);

}  // namespace vlp
