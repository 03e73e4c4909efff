// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace vlp {

/// Runs a program for each line of stdin, one after the other, each in a process of its own that is
/// split off this one: to load what a program is linked with takes as long as a fifth of a session.
/// A line is JSON, {"arguments": ["SESSION", "-o", "RESULTS"], "limit_s": 3600}; the answer, a line
/// on stdout, is {"exit_code": 0, "cpu_s": 0.61, "said": "..."}: of a process that was killed the
/// signal's number, negative (SIGALRM: the limit), its processor time, and the end of what it wrote
/// to stdout and stderr. `program` is given what main() would be. Throws
/// std::invalid_argument at a line that is none of these, std::runtime_error when no process can be
/// made.
void run_each(const char* name, const std::function<int(int argc, char** argv)>& program);

}  // namespace vlp
