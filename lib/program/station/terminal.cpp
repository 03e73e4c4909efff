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
#include <thread>

#include "captures/printable.h"

namespace vlp {
namespace {

std::atomic<bool> stop_requested = false;

/// Settings of the terminal before construction of a Terminal and while it reads keys, for signal
/// handlers.
termios original_settings{}, key_settings{};
std::atomic<bool> resumed = false;

/// Restores the settings of the terminal and raises the signal with its default action. A process
/// that continues afterwards reads keys again.
void restore_and_raise(int signal) {
  const int error_before = errno;
  ::tcsetattr(STDIN_FILENO, TCSANOW, &original_settings);
  std::signal(signal, SIG_DFL);
  sigset_t signals, blocked;
  sigemptyset(&signals);
  sigaddset(&signals, signal);
  ::raise(signal);
  ::pthread_sigmask(SIG_UNBLOCK, &signals, &blocked);  // the signal takes effect here
  ::pthread_sigmask(SIG_SETMASK, &blocked, nullptr);
  std::signal(signal, restore_and_raise);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &key_settings);
  resumed = true;
  errno = error_before;
}

const char* color_code(ScreenLineStyle style) {
  switch (style) {
    case ScreenLineStyle::heading:
      return "\x1b[1m";
    case ScreenLineStyle::pass:
      return "\x1b[32m";
    case ScreenLineStyle::fail:
      return "\x1b[31m";
    case ScreenLineStyle::plain:
      break;
  }
  return "";
}

bool read_key(char& key, int wait_ms) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return ::poll(&input, 1, wait_ms) > 0 && ::read(STDIN_FILENO, &key, 1) == 1;
}

constexpr int kMaxScannerPause_ms = 30;

}  // namespace

Terminal::Terminal() : interactive_(::isatty(::fileno(stdout)) == 1) {
  const char* no_color = std::getenv("NO_COLOR");
  has_color_ = interactive_ && (no_color == nullptr || *no_color == '\0');
  std::signal(SIGINT, [](int) { stop_requested = true; });
  std::signal(SIGTERM, [](int) { stop_requested = true; });
  if (!interactive_ || ::tcgetattr(STDIN_FILENO, &original_settings) != 0) return;
  key_settings = original_settings;
  key_settings.c_lflag &= static_cast<tcflag_t>(~(ICANON | ECHO));
  reads_keys_ = ::tcsetattr(STDIN_FILENO, TCSANOW, &key_settings) == 0;
  std::signal(SIGQUIT, restore_and_raise);
  std::signal(SIGTSTP, restore_and_raise);
}

Terminal::~Terminal() {
  if (reads_keys_) ::tcsetattr(STDIN_FILENO, TCSANOW, &original_settings);
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGTSTP}) std::signal(signal, SIG_DFL);
}

Terminal::Size Terminal::query_size() {
  winsize known{};
  if (::ioctl(::fileno(stdout), TIOCGWINSZ, &known) != 0 || known.ws_col == 0 ||
      known.ws_row == 0) {
    return {80, 24};
  }
  return {known.ws_col, known.ws_row};
}

bool Terminal::was_resized() const {
  return interactive_ && num_drawn_lines_ > 0 && (query_size() != size_ || resumed);
}

/// Replaces the drawn text. Clears the screen after a change of size or a stop, because the
/// position of the drawn text is unknown then.
void Terminal::replace_text(const std::string& text, std::size_t lines) {
  const Size current_size = query_size();
  const bool moved = num_drawn_lines_ > 0 && (resumed.exchange(false) || current_size != size_);
  if (text == last_text_ && !moved) return;
  const std::string home = moved                  ? "\x1b[2J\x1b[H"
                           : num_drawn_lines_ > 0 ? fmt::format("\x1b[{}A\r", num_drawn_lines_)
                                                  : "";
  fmt::print("{}{}\x1b[J", home, text);
  std::fflush(stdout);
  last_text_ = text;
  num_drawn_lines_ = lines;
  size_ = current_size;
}

void Terminal::redraw(const std::vector<ScreenLine>& lines) {
  if (!interactive_) return;
  const auto [columns, rows] = query_size();
  const std::size_t num_lines = std::min(lines.size(), rows - 1);
  std::string text;
  for (std::size_t i = 0; i < num_lines; ++i) {
    // The last line lists the keys and is always drawn.
    const auto& [line, style] = i + 1 == num_lines ? lines.back() : lines[i];
    text += colorize_text(truncate_utf8_text(escape_for_line(line), columns), style) + "\x1b[K\n";
  }
  replace_text(text, num_lines);
}

void Terminal::print_permanent_lines(const std::vector<ScreenLine>& lines) {
  std::string text;
  for (const auto& [line, style] : lines) {
    text += colorize_text(escape_for_line(line), style) + (interactive_ ? "\x1b[K\n" : "\n");
  }
  if (!interactive_) {
    fmt::print("{}", text);
    std::fflush(stdout);  // the next output may be delayed
    return;
  }
  replace_text(text, lines.size());
  num_drawn_lines_ = 0;
  last_text_.clear();
}

std::string Terminal::colorize_text(const std::string& text, ScreenLineStyle style) const {
  return has_color_ ? fmt::format("{}{}\x1b[0m", color_code(style), text) : text;
}

std::optional<char> Terminal::wait_for_key(int wait_ms) const {
  if (!reads_keys_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    return std::nullopt;
  }
  char first = 0, key = 0;
  if (!read_key(first, wait_ms)) return std::nullopt;
  bool alone = true;
  while (!was_interrupted() && read_key(key, kMaxScannerPause_ms)) alone = alone && key == first;
  return alone ? std::optional(first) : std::nullopt;
}

void Terminal::discard_typed_keys() const {
  char key = 0;
  while (reads_keys_ && !was_interrupted() && read_key(key, kMaxScannerPause_ms)) continue;
}

std::optional<std::string> Terminal::read_input_line(std::vector<ScreenLine> prompt) {
  constexpr char escape = 0x1b, backspace = 0x08, del = 0x7f, end = 0x04;
  constexpr int poll_interval_ms = 100;
  constexpr std::size_t max_bytes = 200, max_character_bytes = 4;
  const std::string prompt_text = prompt.back().text;
  std::string typed;
  if (!interactive_ && ::isatty(STDIN_FILENO) == 1) {
    fmt::print(stderr, "{}\n", escape_for_terminal(prompt_text));
  }
  for (;;) {
    prompt.back().text = prompt_text + typed;
    redraw(prompt);
    pollfd input{STDIN_FILENO, POLLIN, 0};
    char key = 0;
    if (was_interrupted()) return std::nullopt;
    if (::poll(&input, 1, poll_interval_ms) < 1) continue;
    const bool ended = ::read(STDIN_FILENO, &key, 1) != 1 || key == end;
    if (ended && typed.empty()) return std::nullopt;
    if (ended || key == '\n' || key == '\r') break;
    if (key == escape) {  // an arrow, or another key of several characters
      while (reads_keys_ && read_key(key, 0)) continue;
    } else if (key == backspace || key == del) {
      if (!typed.empty()) typed = truncate_utf8_text(typed, typed.size() - 1);
    } else if (static_cast<unsigned char>(key) >= ' ' &&
               typed.size() < max_bytes + max_character_bytes) {
      typed += key;
    }
  }
  if (interactive_) print_permanent_lines(prompt);  // keeps the line on the screen
  typed = truncate_utf8_text(typed, max_bytes);
  const auto first = typed.find_first_not_of(' ');
  return first == std::string::npos ? ""
                                    : typed.substr(first, typed.find_last_not_of(' ') + 1 - first);
}

bool was_interrupted() { return stop_requested; }

}  // namespace vlp
