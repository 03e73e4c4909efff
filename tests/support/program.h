// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

struct ProgramResult {
  int exit_code;  // 128 + the signal when one ended it
  std::string output;
  std::string errors;
};

/// Runs a shell command line; `vlp-...` programs are found in the build. Lines of progress are left
/// out of the errors.
ProgramResult run_program(const std::string& command);

}  // namespace vlp
