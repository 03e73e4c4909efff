// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// Part of the report that a plot belongs to.
enum class ReportPart { camera, rotation, dispersion, floor, distribution, tracks, other };

/// Plot or image of the report with its caption, alternative text and table.
struct ReportPlot {
  ReportPart part;
  /// Complete content of an SVG or PNG file; empty until render_plots() if there is a
  /// drawing.
  std::string image;
  /// Caption: content of the plot and how to read it. Alt: description for readers who cannot see
  /// it.
  std::string caption, alt;
  /// Table below the plot, see Drawing::table.
  std::vector<std::vector<std::string>> table = {};
  /// Drawing that is not rendered yet.
  std::optional<Drawing> drawing = {};
};

/// Reads a plot of another program. An SVG is recognized by its title. Images without a known title
/// (a PNG has none) belong to `other`, with the file name as caption.
/// @throws InputError if the file cannot be read, is longer than 16 MiB, or is neither SVG nor PNG
ReportPlot read_report_plot(const std::filesystem::path& file);

/// Returns a drawing as a plot of the report, to be rendered by render_plots().
ReportPlot make_report_plot(Drawing drawing);

/// Renders each drawing into `image` and removes the drawing. Other plots are unchanged.
/// @throws InputError as render_plots_as_svg()
void render_plots(std::vector<ReportPlot>& plots);
/// Renders a drawing as a plot of the report.
/// @throws InputError as render_plots_as_svg()
ReportPlot render_report_plot(Drawing drawing);

}  // namespace vlp
