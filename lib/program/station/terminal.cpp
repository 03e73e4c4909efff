// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/terminal.h"

#include <fmt/core.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>

#include "captures/printable.h"

namespace vlp {
namespace {

std::atomic<bool> stop_asked = false;

/// Settings of the terminal before construction of a Terminal and while it reads keys, for signal
/// handlers.
termios modes_before{}, modes_of_keys{};
std::atomic<bool> resumed = false;

/// Restores the settings of the terminal and raises the signal with its default action. A process
/// that continues afterwards reads keys again.
void put_back_and_raise(int signal) {
  const int error_before = errno;
  ::tcsetattr(STDIN_FILENO, TCSANOW, &modes_before);
  std::signal(signal, SIG_DFL);
  sigset_t signals, blocked;
  sigemptyset(&signals);
  sigaddset(&signals, signal);
  ::raise(signal);
  ::pthread_sigmask(SIG_UNBLOCK, &signals, &blocked);  // the signal takes effect here
  ::pthread_sigmask(SIG_SETMASK, &blocked, nullptr);
  std::signal(signal, put_back_and_raise);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &modes_of_keys);
  resumed = true;
  errno = error_before;
}

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

bool read_key(char& key, int wait_ms) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return ::poll(&input, 1, wait_ms) > 0 && ::read(STDIN_FILENO, &key, 1) == 1;
}

constexpr int kSlowerThanAScanner_ms = 30;

}  // namespace

struct Terminal::Saved {
  bool keys = false;
  termios settings{};
};

Terminal::Terminal() : interactive_(::isatty(::fileno(stdout)) == 1), saved_(new Saved) {
  const char* no_colour = std::getenv("NO_COLOR");
  colour_ = interactive_ && (no_colour == nullptr || *no_colour == '\0');
  std::signal(SIGINT, [](int) { stop_asked = true; });
  std::signal(SIGTERM, [](int) { stop_asked = true; });
  if (!interactive_ || ::tcgetattr(STDIN_FILENO, &saved_->settings) != 0) return;
  termios settings = saved_->settings;
  settings.c_lflag &= static_cast<tcflag_t>(~(ICANON | ECHO));
  saved_->keys = ::tcsetattr(STDIN_FILENO, TCSANOW, &settings) == 0;
  modes_before = saved_->settings;
  modes_of_keys = settings;
  std::signal(SIGQUIT, put_back_and_raise);
  std::signal(SIGTSTP, put_back_and_raise);
}

Terminal::~Terminal() {
  if (saved_->keys) ::tcsetattr(STDIN_FILENO, TCSANOW, &saved_->settings);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  std::signal(SIGQUIT, SIG_DFL);
  std::signal(SIGTSTP, SIG_DFL);
}

Terminal::Size Terminal::size() {
  winsize known{};
  if (::ioctl(::fileno(stdout), TIOCGWINSZ, &known) != 0 || known.ws_col == 0 ||
      known.ws_row == 0) {
    return {80, 24};
  }
  return {known.ws_col, known.ws_row};
}

bool Terminal::resized() const {
  return interactive_ && drawn_ > 0 && (size() != size_ || resumed);
}

/// Replaces the drawn text. Clears the screen after a change of size or a stop, because the
/// position of the drawn text is unknown then.
void Terminal::show(const std::string& text, std::size_t lines) {
  const Size now = size();
  const bool moved = drawn_ > 0 && (resumed.exchange(false) || now != size_);
  if (text == last_ && !moved) return;
  const std::string home = moved        ? "\x1b[2J\x1b[H"
                           : drawn_ > 0 ? fmt::format("\x1b[{}A\r", drawn_)
                                        : "";
  fmt::print("{}{}\x1b[J", home, text);
  std::fflush(stdout);
  last_ = text;
  drawn_ = lines;
  size_ = now;
}

void Terminal::draw(const std::vector<ScreenLine>& lines) {
  if (!interactive_) return;
  const auto [columns, rows] = size();
  const std::size_t shown = std::min(lines.size(), rows - 1);
  std::string text;
  for (std::size_t i = 0; i < shown; ++i) {
    // The last line lists the keys and is always drawn.
    const auto& [line, tone] = i + 1 == shown ? lines.back() : lines[i];
    text += toned(first_characters(printable_line(line), columns), tone) + "\x1b[K\n";
  }
  show(text, shown);
}

void Terminal::print(const std::vector<ScreenLine>& lines) {
  std::string text;
  for (const auto& [line, tone] : lines) {
    text += toned(printable_line(line), tone) + (interactive_ ? "\x1b[K\n" : "\n");
  }
  if (!interactive_) {
    fmt::print("{}", text);
    std::fflush(stdout);  // the next output may be delayed
    return;
  }
  show(text, lines.size());
  drawn_ = 0;
  last_.clear();
}

std::string Terminal::toned(const std::string& text, Tone tone) const {
  return colour_ ? fmt::format("{}{}\x1b[0m", colour_of(tone), text) : text;
}

std::optional<char> Terminal::key(int wait_ms) const {
  if (!saved_->keys) {
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    return std::nullopt;
  }
  char first = 0, key = 0;
  if (!read_key(first, wait_ms)) return std::nullopt;
  bool alone = true;
  while (!interrupted() && read_key(key, kSlowerThanAScanner_ms)) alone = alone && key == first;
  return alone ? std::optional(first) : std::nullopt;
}

void Terminal::forget_keys() const {
  char key = 0;
  while (saved_->keys && !interrupted() && read_key(key, kSlowerThanAScanner_ms)) continue;
}

std::optional<std::string> Terminal::line(std::vector<ScreenLine> prompt) {
  constexpr char escape = 0x1b, backspace = 0x08, del = 0x7f, end = 0x04;
  constexpr int look_every_ms = 100;
  constexpr std::size_t longest = 200, most_of_a_character = 4;
  const std::string asked = prompt.back().text;
  std::string typed;
  if (!interactive_ && ::isatty(STDIN_FILENO) == 1) {
    fmt::print(stderr, "{}\n", printable(asked));
  }
  for (;;) {
    prompt.back().text = asked + typed;
    draw(prompt);
    pollfd input{STDIN_FILENO, POLLIN, 0};
    char key = 0;
    if (interrupted()) return std::nullopt;
    if (::poll(&input, 1, look_every_ms) < 1) continue;
    const bool ended = ::read(STDIN_FILENO, &key, 1) != 1 || key == end;
    if (ended && typed.empty()) return std::nullopt;
    if (ended || key == '\n' || key == '\r') break;
    if (key == escape) {  // an arrow, or another key of several characters
      while (saved_->keys && read_key(key, 0)) continue;
    } else if (key == backspace || key == del) {
      if (!typed.empty()) typed = first_characters(typed, typed.size() - 1);
    } else if (static_cast<unsigned char>(key) >= ' ' &&
               typed.size() < longest + most_of_a_character) {
      typed += key;
    }
  }
  if (interactive_) print(prompt);  // keeps the line on the screen
  typed = first_characters(typed, longest);
  const auto first = typed.find_first_not_of(' ');
  return first == std::string::npos ? ""
                                    : typed.substr(first, typed.find_last_not_of(' ') + 1 - first);
}

bool interrupted() { return stop_asked; }

}  // namespace vlp
