// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// Its header costs a file that includes it ten seconds of compilation.
namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace vlp {

/// Exit codes of every program.
enum ExitCode : int { kDone = 0, kGateNotMet = 1, kBadInput = 2, kUndetermined = 3 };

/// The data cannot determine the answer; what() says what to add. Exit code 3.
class Undetermined : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// All is done and written, but a gate is not met; what() says which. Exit code 1.
class GateNotMet : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// How many threads there are when nobody says so.
int all_cores();

/// Checks for options: a number that is finite, and positive, or not negative.
CLI::Validator finite();
CLI::Validator finite_positive();
CLI::Validator finite_not_negative();

/// A file's name that ends so; the name of a picture, .png or .svg.
CLI::Validator ends_in(const std::string& ending);
CLI::Validator is_picture();

/// Adds --threads: `what` are done so many at a time.
void add_threads_option(CLI::App& app, int& threads, const std::string& what = "Images at a time");

/// Throws std::invalid_argument when `output` is one of the files that are read.
void check_output(const std::string& output, const std::vector<std::string>& inputs);

/// check_output() of all outputs, each with the option that names it, and that no two are one file;
/// an empty name is none.
void check_outputs(const std::vector<std::pair<std::string, std::string>>& outputs,
                   const std::vector<std::string>& inputs);

/// The common shell of a program: adds --quiet, --verbose and --version to `app`, makes its --help
/// fit 80 columns, parses, and calls `run`. Messages go through spdlog to stderr. Bad usage and bad
/// input end with one line and exit code 2, Undetermined with 3, GateNotMet with 1. `--reference`
/// prints what is installed beside it (reference.h).
int run_app(CLI::App& app, int argc, char** argv, const std::function<void()>& run);

}  // namespace vlp
