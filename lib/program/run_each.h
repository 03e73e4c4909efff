// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace vlp {

/// Runs a program once for each line of stdin, sequentially, each time in a forked process. Forking
/// avoids loading the shared libraries, which takes 20 % of the time of a session. Returns at the
/// end of stdin.
///
/// A line is JSON: {"arguments": ["SESSION", "-o", "RESULTS"], "limit_s": 3600}. The answer is a
/// line on stdout: {"exit_code": 0, "cpu_s": 0.61, "output": "..."} with
///
///   exit_code  exit code, or the negative number of the signal that killed the process (SIGALRM:
///              the time limit)
///   cpu_s      processor time of the process, s
///   output     last 4096 bytes of its stdout and stderr
///
/// @param name     argv[0] of the program
/// @param program  function called in place of main()
/// @throws std::invalid_argument if a line is not such a request
/// @throws std::runtime_error if no process can be created
void run_each_line(const char* name, const std::function<int(int argc, char** argv)>& program);

}  // namespace vlp
