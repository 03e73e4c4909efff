// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/progress.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cmath>

namespace vlp {

Progress::Progress(std::string things)
    : things_(std::move(things)),
      is_shown_(spdlog::should_log(spdlog::level::info)),
      terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (line_open_) fmt::print(stderr, "\n");
}

void Progress::update(std::size_t done, std::size_t total, std::size_t skipped) {
  using namespace std::chrono_literals;
  const auto now = Clock::now();
  const bool due = now - last_ >= (terminal_ ? 100ms : 5000ms) || (terminal_ && done == total);
  if (!is_shown_ || !due || done == skipped) return;
  last_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double rate = static_cast<double>(done - skipped) / seconds;
  const long left_s = std::lround(static_cast<double>(total - done) / rate);
  const std::string text = fmt::format("{} of {} {}, {:.1f} a second, {}:{:02} left", done, total,
                                       things_, rate, left_s / 60, left_s % 60);
  if (terminal_) {
    fmt::print(stderr, "\r{}\x1b[K", text);
    line_open_ = true;
  } else {
    spdlog::info("{}", text);
  }
}

}  // namespace vlp
