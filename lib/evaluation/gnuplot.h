// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace vlp {

/// Draws `commands` (gnuplot's language, without `set terminal` and `set output`) into `picture`,
/// .png or .svg by its ending, whole or not at all. Same commands, same bytes. Throws InputError
/// when the ending is another, gnuplot is missing or fails, or the file cannot be written.
void draw(const std::filesystem::path& picture, int width_px, int height_px,
          const std::string& commands);

/// `text` as a gnuplot string literal, with nothing in it interpreted.
std::string gnuplot_quoted(const std::string& text);

}  // namespace vlp
