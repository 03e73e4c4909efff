// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// Program to run as a child process.
struct ChildCommand {
  /// Name or path of the program, and its arguments, passed without a shell.
  std::vector<std::string> words;
  /// Text on its stdin, which is a file in memory.
  std::string input = {};
  /// Working directory; empty: that of this process.
  std::filesystem::path folder = {};
  /// Time after which the process and its group are killed, s.
  double time_limit_s;
  /// Number of bytes that are kept of the end of the output.
  std::size_t max_output_bytes;
  /// If true, the output contains stderr, which is discarded otherwise.
  bool has_stderr = false;
  /// Descriptor that the process inherits as 3; negative: none.
  int descriptor = -1;
  /// If true, also kills descendants that left the group, at the time limit. Requires that no other
  /// thread starts processes.
  bool kills_descendants = false;
};

/// Result of run_child().
struct ChildResult {
  /// Reason why it was not started, or why its status is unknown; empty otherwise.
  std::string start_error = {}, status_error = {};
  /// Status of waitpid(); std::nullopt if the process was killed at the time limit, and with an
  /// error.
  std::optional<int> status = {};
  std::string output = {};

  bool has_succeeded() const;
};

/// Runs a program in its own process group with default signal handling and no other descriptor,
/// and waits for its end. Sets SIGCHLD to its default.
ChildResult run_child(const ChildCommand& command);

}  // namespace vlp
