// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "station/unit/station_screen.h"

namespace vlp {

/// Display for the operator: on a terminal one screen that is redrawn in place, in color unless
/// NO_COLOR is set. Without a terminal, only print_permanent_lines() writes.
class Terminal {
 public:
  /// Switches stdin to single keys without echo if stdin and stdout are terminals. In any case,
  /// SIGINT and SIGTERM do not end the process but are recorded (was_interrupted()).
  /// Both until destruction.
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  bool is_interactive() const { return interactive_; }
  /// Redraws the screen in place if the lines have changed; only on a terminal. Crops lines to the
  /// size of the terminal, but keeps the last one.
  void redraw(const std::vector<ScreenLine>& lines);
  /// Replaces the drawn screen by lines that stay.
  void print_permanent_lines(const std::vector<ScreenLine>& lines);
  /// Returns true if the size of the terminal has changed since the last redraw(),
  /// or if the process was stopped (Ctrl-Z) since then.
  bool was_resized() const;
  /// Returns the key pressed within `wait_ms`; std::nullopt if there is none. Several different
  /// keys in quick succession come from a scanner and are ignored; repetitions of one key count as
  /// one.
  std::optional<char> wait_for_key(int wait_ms) const;
  /// Discards the keys typed so far on a terminal, up to a pause longer than a scanner's.
  void discard_typed_keys() const;
  /// Reads a line from the keyboard, a scanner or a file, without surrounding blanks. Longer lines
  /// are cut to 200 bytes, in whole UTF-8 characters.
  ///
  /// @param prompt  lines to draw; the input follows the last one. Only the last one is printed, to
  ///                stderr, if stdin is a terminal and stdout is not.
  /// @return        std::nullopt at the end of the input and after SIGINT or SIGTERM
  std::optional<std::string> read_input_line(std::vector<ScreenLine> prompt);

 private:
  struct Size {
    std::size_t columns, rows;
    bool operator==(const Size&) const = default;
  };
  static Size query_size();
  void replace_text(const std::string& text, std::size_t lines);
  std::string colorize_text(const std::string& text, ScreenLineStyle style) const;

  bool interactive_, has_color_, reads_keys_ = false;
  std::size_t num_drawn_lines_ = 0;
  std::string last_text_;
  Size size_{};
};

/// Returns true if SIGINT or SIGTERM arrived while a Terminal existed. The program should end; its
/// work is on disk.
bool was_interrupted();

}  // namespace vlp
