// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "frontend/observation.h"
#include "session/step_result.h"

namespace vlp {

/// Returns the rejected images with their reasons, by name, or with their folders if there are
/// several folders. Rejected frames of a video, of which there are many, are one entry per video
/// and reason, with their number.
std::vector<SkippedImage> skipped_images(const std::vector<Observation>& images);

/// Adds the remarks of an intake to the result of a step: skipped images, warnings, notes, details,
/// and the failure, if no image can be used.
void add_remarks(const Observations& seen, StepResult& result);

}  // namespace vlp
