// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "rig/calibration.h"
#include "session/step_result.h"

namespace CLI {
class App;
}

namespace vlp {

/// Prints the remarks of a step to stderr: skipped images, warnings, notes, details.
void print_step_remarks(const StepResult& result);

/// Throws an exception with the message of the result if the step failed, otherwise does nothing.
/// @throws Undetermined for StepFailure::undetermined
/// @throws std::invalid_argument for all other failures
void require_success(const StepResult& result);

/// Returns the options that do not affect the recorded result: --output, other outputs, a cache,
/// and options of the display.
std::span<const std::string_view> list_omitted_options();

/// Makes the history entry of a part of a calibration, without the name of the part
/// (rig/calibration_builder.h). Holds program and version, the given options in the order of
/// --help, and a digest of each input.
///
/// The entry is the same on every machine: paths are reduced to their last component, and
/// list_omitted_options() are omitted.
///
/// @param inputs  files and folders of images; an empty name is an input that was not given
/// @throws InputError if an input cannot be read
/// @pre `app` has parsed the command line
HistoryEntry make_command_entry(const CLI::App& app, const std::vector<std::string>& inputs);

}  // namespace vlp
