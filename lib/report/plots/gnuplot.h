// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vlp {

/// A picture before it is drawn.
struct Drawing {
  /// What it shows: letters, digits and underscores. It becomes the title of an SVG.
  std::string name;
  int width_px, height_px;
  /// In gnuplot's language, without `set terminal` and `set output`.
  std::string commands;
  /// Table below the picture in a report, its first row the header; may be empty.
  std::vector<std::vector<std::string>> table = {};
};

/// Draws into `picture`, .png or .svg by its ending, whole or not at all. Same commands, same
/// bytes. Throws InputError when the ending is another, gnuplot is missing or fails, or the file
/// cannot be written.
void draw(const std::filesystem::path& picture, const Drawing& drawing);

/// The text of the SVG. Throws InputError when gnuplot is missing or fails.
std::string svg_of(const Drawing& drawing);

}  // namespace vlp
