// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// Part of the report that a plot belongs to.
enum class ReportPart { camera, rotation, dispersion, floor, distribution, tracks, other };

/// Rendered plot or image of the report with its caption, alternative text and table.
struct ReportPlot {
  ReportPart part;
  /// Complete content of an SVG or PNG file.
  std::string image;
  /// Caption: content of the plot and how to read it. Alt: description for readers who cannot see
  /// it.
  std::string caption, alt;
  /// Table below the plot, see Drawing::table.
  std::vector<std::vector<std::string>> table = {};
};

/// Reads a plot of another program. An SVG is recognized by its title. Images without a known title
/// (a PNG has none) belong to `other`, with the file name as caption.
/// @throws InputError if the file cannot be read, is longer than 16 MiB, or is neither SVG nor PNG
ReportPlot read_report_plot(const std::filesystem::path& file);

/// Renders a drawing as a report picture.
/// @throws InputError as render_plot_as_svg()
ReportPlot render_report_plot(const Drawing& drawing);

}  // namespace vlp
