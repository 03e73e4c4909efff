// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace vlp {

/// Plot as a gnuplot script.
struct Drawing {
  /// Name of the plot, which consists of letters, digits and underscores. It becomes the title
  /// element of an SVG.
  std::string name;
  int width_px, height_px;
  /// gnuplot commands without `set terminal` and `set output`.
  std::string commands;
  /// Table below the plot in a report, its first row the header; may be empty.
  std::vector<std::vector<std::string>> table = {};
};

/// Renders into the file `file`, .png or .svg by its extension; the file is written atomically.
/// The same commands yield the same bytes.
/// @throws InputError if the extension is another one, gnuplot is missing or fails, or the file
/// cannot be written
void write_plot(const std::filesystem::path& file, const Drawing& drawing);

/// Renders drawings as SVG text, in their order, with one gnuplot process, because its start takes
/// longer than most drawings.
/// @throws InputError with the names of the drawings if gnuplot is missing or fails
std::vector<std::string> render_plots_as_svg(std::span<const Drawing> drawings);
std::string render_plot_as_svg(const Drawing& drawing);

}  // namespace vlp
