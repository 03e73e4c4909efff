// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

struct ProgramResult {
  int exit_code;  // 128 + the number of the signal that ended the program
  std::string output;
  std::string errors;
};

/// Runs a shell command line. Programs `vlp-...` are found in the build. `errors` excludes lines of
/// progress.
ProgramResult run_program(const std::string& command);

}  // namespace vlp
