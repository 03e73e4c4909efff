// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

namespace vlp {

/// Returns the largest of ..., 0.1, 0.2, 0.5, 1, 2, 5, ... that does not exceed `value`, except for
/// rounding.
/// @pre value > 0
double round_down_to_1_2_5(double value);

/// Returns consecutive numbers of the series ..., 0.5, 1, 2, 5, 10, ..., ascending. The first is
/// the largest one that does not exceed `lowest`. The last is the smallest one that is not below
/// `highest`. If both are the same number, the next larger one follows, so that there are two.
/// @pre 0 < lowest <= highest
std::vector<double> list_1_2_5_series(double lowest, double highest);

/// Formats a number for humans with `digits` significant digits. Integer digits are all kept, so
/// that large numbers have no exponent.
std::string format_number_for_humans(double value, int digits);

/// Format a length in millimeters with three significant digits. format_mm() has no unit
/// and keeps all integer digits, as format_number_for_humans(). format_with_mm()
/// appends the unit and is for columns.
std::string format_mm(double length_m);
std::string format_with_mm(double length_m);

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
std::string quote_for_gnuplot(const std::string& text);

/// Significant digits of the numbers in a plot.
constexpr int kPlotDigits = 7;

/// Returns a line of numbers.
std::string format_data_row(std::initializer_list<double> values);

/// Returns rows as the data block `$name`.
std::string make_data_block(const std::string& name, const std::string& rows);

/// Returns the settings common to all plots: encoding, tics, grid, key below, label boxes, and the
/// palette viridis. Viridis is even in lightness, and readable in gray and for the color-blind.
std::string make_settings();

/// Returns the command that sets the title, without interpretation of its content.
std::string make_gnuplot_title_command(const std::string& title);

/// Returns the clause of a color, with a space before and after.
std::string make_color_clause(const std::string& color);

/// Returns the range `[from:to]`.
std::string format_gnuplot_range(double from, double to);

/// Returns the step, at least 1, for which every step-th of `count` items are no more than
/// `max_count` items.
/// @pre max_count > 0
std::size_t compute_thinning_step(std::size_t count, std::size_t max_count);

/// Returns "every 3rd of 250 drawn"; empty for a step of 1.
std::string describe_thinning(std::size_t count, std::size_t step);

/// Returns the ascending indices of every step-th value and of the `largest` largest values.
std::vector<std::size_t> thin_out_indices(std::span<const double> values, std::size_t step,
                                          std::size_t largest);

}  // namespace vlp
