// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "terminal.h"

#include <fmt/core.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <thread>

namespace vlp {
namespace {

std::atomic<bool> stop_asked = false;

const char* colour_of(Tone tone) {
  switch (tone) {
    case Tone::heading:
      return "\x1b[1m";
    case Tone::good:
      return "\x1b[32m";
    case Tone::bad:
      return "\x1b[31m";
    case Tone::plain:
      break;
  }
  return "";
}

}  // namespace

struct Terminal::Saved {
  bool keys = false;
  termios settings{};
};

Terminal::Terminal() : interactive_(::isatty(STDOUT_FILENO) == 1), saved_(new Saved) {
  const char* no_colour = std::getenv("NO_COLOR");
  colour_ = interactive_ && (no_colour == nullptr || *no_colour == '\0');
  std::signal(SIGINT, [](int) { stop_asked = true; });
  std::signal(SIGTERM, [](int) { stop_asked = true; });
  if (!interactive_ || ::tcgetattr(STDIN_FILENO, &saved_->settings) != 0) return;
  termios settings = saved_->settings;
  settings.c_lflag &= static_cast<tcflag_t>(~(ICANON | ECHO));
  saved_->keys = ::tcsetattr(STDIN_FILENO, TCSANOW, &settings) == 0;
}

Terminal::~Terminal() {
  if (saved_->keys) ::tcsetattr(STDIN_FILENO, TCSANOW, &saved_->settings);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

void Terminal::draw(const std::vector<ScreenLine>& lines) {
  if (!interactive_) return;
  std::string text;
  for (const auto& [line, tone] : lines) {
    text += colour_ ? fmt::format("{}{}\x1b[0m\x1b[K\n", colour_of(tone), line) : line + "\x1b[K\n";
  }
  if (text == last_) return;
  const std::string home = drawn_ > 0 ? fmt::format("\x1b[{}A\r", drawn_) : "";
  fmt::print("{}{}\x1b[J", home, text);
  std::fflush(stdout);
  last_ = text;
  drawn_ = lines.size();
}

void Terminal::print(const std::vector<ScreenLine>& lines) {
  if (interactive_) {
    draw(lines);
    drawn_ = 0;
    last_.clear();
    return;
  }
  for (const auto& [line, tone] : lines) fmt::print("{}\n", line);
}

std::optional<char> Terminal::key(int wait_ms) const {
  if (!saved_->keys) {
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    return std::nullopt;
  }
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char key = 0;
  if (::poll(&input, 1, wait_ms) < 1 || ::read(STDIN_FILENO, &key, 1) != 1) return std::nullopt;
  return key;
}

bool interrupted() { return stop_asked; }

}  // namespace vlp
