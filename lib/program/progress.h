// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace vlp {

/// Progress display of long work on stderr: one line that is redrawn on a terminal, otherwise an
/// occasional plain line. Silent under --quiet.
class Progress {
 public:
  /// Creates a display without output; update() prints.
  /// @param things  plural name of the counted items, for example "captures"
  explicit Progress(std::string things);
  /// Ends the line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Updates the display. `skipped` items needed no work: they are included in `done`, but do not
  /// enter the speed.
  void update(std::size_t done, std::size_t total, std::size_t skipped = 0);

 private:
  using Clock = std::chrono::steady_clock;

  std::string things_;
  bool is_shown_, terminal_, line_open_ = false;
  Clock::time_point start_ = Clock::now(), last_ = start_;
};

}  // namespace vlp
