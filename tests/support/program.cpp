// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "support/program.h"

#include <sys/wait.h>

#include <cstdlib>

#include "support/temporary_folder.h"

namespace vlp {

ProgramResult run_program(const std::string& command) {
  const TemporaryFolder folder;
  const auto output = folder / "stdout", errors = folder / "stderr";
  const std::string line = "PATH='" VLP_PROGRAMS_DIR "':\"$PATH\"; { " + command + "\n} >'" +
                           output.string() + "' 2>'" + errors.string() + "' </dev/null";
  const int status = std::system(line.c_str());
  const int exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return {exit_code, TemporaryFolder::content_of(output), TemporaryFolder::content_of(errors)};
}

}  // namespace vlp
