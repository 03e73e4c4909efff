// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "session/step_result.h"

namespace vlp {

/// Prints the remarks of a step to stderr: skipped images, warnings, notes, details.
void print_remarks(const StepResult& result);

/// Throws if the step failed: Undetermined for StepFailure::undetermined, std::invalid_argument for
/// all other failures.
void throw_if_failed(const StepResult& result);

}  // namespace vlp
