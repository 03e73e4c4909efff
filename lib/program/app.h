// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Forward declarations: including CLI11 costs ten seconds of compilation per file.
namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace vlp {

/// Exit codes of every program.
enum ExitCode : int { kDone = 0, kGateNotMet = 1, kBadInput = 2, kUndetermined = 3 };

/// Exception for data that cannot determine the answer; what() is one line with the remedy.
/// parse_and_run() prints it and returns the exit code 3.
class Undetermined : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Exception for a failed gate after all results are written; what() names the gate. Exit code 1.
class GateNotMet : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Returns the default number of threads: the number of cores, at least 1.
int count_cpu_cores();

/// Returns the parser of a program's arguments. Compiles the constructor of CLI::App once instead
/// of in each program.
std::unique_ptr<CLI::App> make_app(const std::string& description, const std::string& name);

/// Return validators of options that accept finite numbers: any, positive, or not negative.
CLI::Validator make_finite_validator();
CLI::Validator make_positive_validator();
CLI::Validator make_non_negative_validator();

/// Returns a validator that accepts file names with this ending.
CLI::Validator make_extension_validator(const std::string& ending);
/// Returns a validator that accepts file names of plots: .png or .svg.
CLI::Validator make_plot_file_validator();

/// Adds --threads. `what` describes the parallel items in --help.
void add_threads_option(CLI::App& app, int& threads,
                        const std::string& description = "Number of images to process in parallel");

/// Throws std::invalid_argument if `output` is one of the input files.
void check_output_is_no_input(const std::string& output, const std::vector<std::string>& inputs);

/// Applies check_output_is_no_input() to all outputs and throws std::invalid_argument if two of
/// them are the same file.
///
/// @param outputs  option and file name of each output; an empty name is ignored
void check_outputs_distinct(const std::vector<std::pair<std::string, std::string>>& outputs,
                            const std::vector<std::string>& inputs);

/// Runs a program: adds --quiet, --verbose and --version to `app`, formats its --help in 80
/// columns, parses the arguments and calls `run`. Messages go through spdlog to stderr.
///
/// Returns the exit code. Errors print one line: bad usage and bad input return 2, Undetermined 3,
/// GateNotMet 1. `--reference` prints the manual page or a shell completion (reference.h).
///
/// @param report_bad_usage  called with the message if the arguments cannot be parsed
int parse_and_run(CLI::App& app, int argc, char** argv, const std::function<void()>& run,
                  const std::function<void(const std::string& message)>& report_bad_usage = {});

/// Returns the value of an option in arguments that need not be valid; empty without the option.
/// @param names  all names of the option, such as "-o" and "--output"
std::string read_option_value(int argc, char** argv, std::initializer_list<std::string_view> names);

}  // namespace vlp
