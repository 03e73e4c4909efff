// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>

namespace vlp {

/// Color-blind safe palette of Okabe and Ito. Items that differ in color also differ in marker or
/// dashes.
namespace plot_colors {
constexpr const char* blue = "#0072b2";
constexpr const char* vermilion = "#d55e00";
constexpr const char* green = "#009e73";
constexpr const char* purple = "#cc79a7";
constexpr const char* gray = "#666666";
}  // namespace plot_colors

/// Returns `text` as a gnuplot string without interpretation of its content; line breaks are kept.
std::string gnuplot_quoted(const std::string& text);

/// Significant digits of the numbers in a plot.
constexpr int kPlotDigits = 7;

/// Returns a line of numbers.
std::string format_data_row(std::initializer_list<double> values);

/// Returns rows as the data block `$name`.
std::string data_block(const std::string& name, const std::string& rows);

/// Returns the settings common to all plots: encoding, tics, grid, key below, label boxes, and the
/// palette viridis. Viridis is even in lightness, and readable in gray and for the color-blind.
std::string plot_settings();

/// Returns the range `[from:to]`.
std::string plot_range(double from, double to);

}  // namespace vlp
