// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "station/unit/station_screen.h"

namespace vlp {

/// What the operator sees: at a terminal one screen that is redrawn in place, in colour unless
/// NO_COLOR is set; elsewhere nothing but the end.
class Terminal {
 public:
  /// Keys are read one by one while it lives, when stdin is a terminal, too.
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  bool interactive() const { return interactive_; }
  /// Redraws in place; only at a terminal, and only when something changed. What has no room at
  /// the terminal's size is left out.
  void draw(const std::vector<ScreenLine>& lines);
  /// Prints in place of what was drawn, to stay.
  void print(const std::vector<ScreenLine>& lines);
  /// Returns true if the terminal has another size than when it was drawn, or if the process was
  /// stopped (Ctrl-Z) since then.
  bool resized() const;
  /// The key that was pressed, if one was, waiting so long at most. Several that come together are
  /// a scanner's, and none; but one key many times is an impatient operator's.
  std::optional<char> key(int wait_ms) const;
  /// Takes what was typed before now, at a terminal, up to a scanner's pause.
  void forget_keys() const;
  /// The line that is typed, or comes from a scanner or a file: asked for by `prompt`, whose last
  /// line it follows; by that line alone, on stderr, when stdout is no terminal but stdin is. 200
  /// bytes at most, in whole characters of UTF-8. Nothing at the end of the input, and when SIGINT
  /// or SIGTERM came.
  std::optional<std::string> line(std::vector<ScreenLine> prompt);

 private:
  struct Saved;
  struct Size {
    std::size_t columns, rows;
    bool operator==(const Size&) const = default;
  };
  static Size size();
  void show(const std::string& text, std::size_t lines);
  std::string toned(const std::string& text, Tone tone) const;

  bool interactive_, colour_;
  std::size_t drawn_ = 0;
  std::string last_;
  Size size_{};
  std::unique_ptr<Saved> saved_;
};

/// Whether SIGINT or SIGTERM came while a Terminal was there: work is on the disk, end it.
bool interrupted();

}  // namespace vlp
