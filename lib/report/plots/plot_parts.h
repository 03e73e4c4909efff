// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>

namespace vlp {

/// Colours of Okabe and Ito, which the colour-blind can tell apart. What differs in colour differs
/// in its marker or its dashes, too.
namespace plot_colors {
constexpr const char* blue = "#0072b2";
constexpr const char* vermillion = "#d55e00";
constexpr const char* green = "#009e73";
constexpr const char* purple = "#cc79a7";
constexpr const char* grey = "#666666";
}  // namespace plot_colors

/// `text` as a gnuplot string, with nothing in it interpreted; lines stay lines.
std::string gnuplot_quoted(const std::string& text);

/// Digits of the numbers in a plot.
constexpr int kPlotDigits = 7;

/// A line of numbers.
std::string data_row(std::initializer_list<double> values);

/// Rows as the data block `$name`.
std::string data_block(const std::string& name, const std::string& rows);

/// What all plots begin with: the encoding, tics, grid, the key below, labels in boxes, and a
/// palette (viridis) for maps that is even in lightness, legible to the colour-blind and in grey.
std::string plot_settings();

/// `[from:to]`, a range.
std::string plot_range(double from, double to);

}  // namespace vlp
