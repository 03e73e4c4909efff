// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "support/program.h"

#include <sys/wait.h>

#include <cstdlib>
#include <regex>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// Removes lines of progress, which appear on slow machines only.
std::string without_progress(const std::string& messages) {
  static const std::regex progress("[^\n]*, [0-9.]+ a second, [0-9]+:[0-9]+ left\n");
  return std::regex_replace(messages, progress, "");
}

}  // namespace

ProgramResult run_program(const std::string& command) {
  const TemporaryFolder folder;
  const auto output = folder / "stdout", errors = folder / "stderr";
  const std::string line = "PATH='" VLP_PROGRAMS_DIR "':\"$PATH\"; { " + command + "\n} >'" +
                           output.string() + "' 2>'" + errors.string() + "' </dev/null";
  const int status = std::system(line.c_str());
  const int exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return {exit_code, TemporaryFolder::read_content(output),
          without_progress(TemporaryFolder::read_content(errors))};
}

}  // namespace vlp
