// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "session/step_result.h"

namespace vlp {

/// Says on stderr what a step has to say: images that were skipped, warnings, notes, details.
void tell(const StepResult& result);

/// Throws Undetermined, or std::invalid_argument where a file is to blame, when the step failed.
void require(const StepResult& result);

}  // namespace vlp
