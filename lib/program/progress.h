// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace vlp {

/// Shows on stderr how far long work is: one line that is redrawn on a terminal; elsewhere a plain
/// line now and then. Says nothing under --quiet.
class Progress {
 public:
  /// `things` is what is counted: "captures".
  explicit Progress(std::string things);
  /// Ends the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `skipped` things needed no work; they count as done, but not for the speed.
  void update(std::size_t done, std::size_t total, std::size_t skipped = 0);

 private:
  using Clock = std::chrono::steady_clock;

  std::string things_;
  bool shown_, terminal_, line_open_ = false;
  Clock::time_point begin_ = Clock::now(), last_ = begin_;
};

}  // namespace vlp
