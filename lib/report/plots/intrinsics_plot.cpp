// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/intrinsics_plot.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "captures/number_text.h"
#include "report/plots/plot_parts.h"
#include "report/plots/round_numbers.h"

namespace vlp {
namespace {

/// Returns the data blocks: corners and outliers as u v du dv, and the map as u v sd.
std::string format_data(const IntrinsicsPlot& plot) {
  std::string corners, outliers, map;
  for (const auto& [seen_px, residual_px, outlier] : plot.corners) {
    (outlier ? outliers : corners) +=
        format_data_row({seen_px.x(), seen_px.y(), residual_px.x(), residual_px.y()});
  }
  const auto [width, height] = plot.imager_px;
  const auto cols = static_cast<std::size_t>(plot.cols), rows = plot.sd_px.size() / cols;
  for (std::size_t row = 0; row < rows; ++row) {
    const double v = (height - 1) * double(row) / double(rows - 1);
    for (std::size_t col = 0; col < cols; ++col) {
      const double u = (width - 1) * double(col) / double(cols - 1);
      const double sd_px = plot.sd_px[row * cols + col];
      map += std::isfinite(sd_px)
                 ? format_data_row({u, v, sd_px})
                 : significant(u, kPlotDigits) + " " + significant(v, kPlotDigits) + " NaN\n";
    }
    map += "\n";
  }
  return data_block("corners", corners) + data_block("outliers", outliers) + data_block("map", map);
}

/// Returns, for example, "12 corners, 3 outliers (crosses)".
std::string describe_counts(const IntrinsicsPlot& plot, const std::string& outliers) {
  const auto left_out = std::count_if(plot.corners.begin(), plot.corners.end(),
                                      [](const auto& corner) { return corner.outlier; });
  const auto used = static_cast<std::ptrdiff_t>(plot.corners.size()) - left_out;
  std::string text = std::to_string(used) + " corners";
  if (left_out > 0) text += ", " + std::to_string(left_out) + " outliers" + outliers;
  return text;
}

/// Returns the plot commands of the corners, and of the outliers if there are any.
std::string layers(const IntrinsicsPlot& plot, const std::string& corner_style,
                   const std::string& outlier_style) {
  std::string layers =
      "plot $corners " + corner_style + " linecolor rgb '" + plot_colors::blue + "' notitle";
  if (std::any_of(plot.corners.begin(), plot.corners.end(),
                  [](const auto& corner) { return corner.outlier; })) {
    layers +=
        ", $outliers " + outlier_style + " linecolor rgb '" + plot_colors::vermilion + "' notitle";
  }
  return layers + "\n";
}

double rms_px(const IntrinsicsPlot& plot) {
  double squares = 0, count = 0;
  for (const auto& corner : plot.corners) {
    if (corner.outlier) continue;
    squares += corner.residual_px.squaredNorm();
    count += 2;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

/// Returns the map of the standard deviations, with logarithmic colors and contour lines at round
/// numbers.
std::string format_sd_map(const IntrinsicsPlot& plot) {
  double min_sd_px = INFINITY, max_sd_px = 0;
  for (const double sd_px : plot.sd_px) {
    if (!std::isfinite(sd_px) || !(sd_px > 0)) continue;
    min_sd_px = std::min(min_sd_px, sd_px);
    max_sd_px = std::max(max_sd_px, sd_px);
  }
  if (max_sd_px == 0) return "plot NaN title 'not determined'\n";
  const auto levels = round_numbers(min_sd_px, max_sd_px);
  std::string tics, lines;
  for (const double level : levels) {
    const std::string text = significant(level, kPlotDigits);
    tics.append(tics.empty() ? "" : ",").append(text);
    if (level > min_sd_px && level < max_sd_px) lines.append(lines.empty() ? "" : ",").append(text);
  }
  std::string commands;
  if (!lines.empty()) {
    commands = "set contour base\nunset surface\nset cntrparam levels discrete " + lines +
               "\nset table $lines\nsplot $map using 1:2:3\nunset table\nunset contour\n";
  }
  const auto rows = plot.sd_px.size() / static_cast<std::size_t>(plot.cols);
  const std::string half_u =
                        significant((plot.imager_px[0] - 1) / 2.0 / (plot.cols - 1), kPlotDigits),
                    half_v =
                        significant((plot.imager_px[1] - 1) / 2.0 / double(rows - 1), kPlotDigits);
  commands += "set cbrange [" + significant(levels.front(), kPlotDigits) + ":" +
              significant(levels.back(), kPlotDigits) + "]\nset cbtics (" + tics +
              ")\nset logscale cb\nset cblabel 'standard deviation (px)'\n"
              "plot $map using 1:2:(" +
              half_u + "):(" + half_v +
              "):3 with boxxyerror fillstyle solid linecolor palette notitle";
  if (!lines.empty()) {
    // Keeps labels away from the image edges.
    const auto away = [](const char* column, int size_px) {
      return "abs(" + std::string(column) + " / " + std::to_string(size_px) + " - 0.5) < 0.44";
    };
    const std::string inside =
        away("$1", plot.imager_px[0]) + " && " + away("$2", plot.imager_px[1]);
    commands +=
        ", $lines using 1:2 with lines linewidth 1.5 linecolor rgb 'white' notitle"
        ", $lines using (" +
        inside + " ? $1 : NaN):2:(sprintf('%g', $3)) every 1000::3 with labels boxed notitle";
  }
  return commands + "\n";
}

/// Returns the commands that draw the map of the MTF50; empty if it was not measured.
std::string format_mtf50_map(const IntrinsicsPlot& plot) {
  const bool is_measured = std::any_of(plot.mtf50.begin(), plot.mtf50.end(),
                                       [](double value) { return std::isfinite(value); });
  if (!is_measured) return "";
  const auto cols = static_cast<std::size_t>(plot.mtf50_cols), rows = plot.mtf50.size() / cols;
  const double half_u = plot.imager_px[0] / 2.0 / double(cols);
  const double half_v = plot.imager_px[1] / 2.0 / double(rows);
  std::string map;
  for (std::size_t i = 0; i < plot.mtf50.size(); ++i) {
    if (!std::isfinite(plot.mtf50[i])) continue;
    const std::size_t col = i % cols, row = i / cols;
    map += format_data_row({(2 * double(col) + 1) * half_u - 0.5,
                            (2 * double(row) + 1) * half_v - 0.5, plot.mtf50[i]});
  }
  return data_block("mtf50", map) +
         "set title 'sharpness: MTF50 of lens and pixel'\n"
         "unset logscale cb\nset cbrange [0:*]\nset cbtics autofreq\n"
         "set cblabel 'cycles per pixel'\nplot $mtf50 using 1:2:(" +
         significant(half_u, kPlotDigits) + "):(" + significant(half_v, kPlotDigits) +
         "):3 with boxxyerror fillstyle solid linecolor palette notitle\n";
}

}  // namespace

double residual_magnification(double rms_px, int width_px) {
  return rms_px > 0 ? round_below(width_px / 40.0 / rms_px) : 1;
}

Drawing make_drawing(const IntrinsicsPlot& plot) {
  assert(plot.cols >= 2 && plot.sd_px.size() >= 2 * static_cast<std::size_t>(plot.cols));
  const auto [width, height] = plot.imager_px;
  const std::string times = significant(residual_magnification(rms_px(plot), width), kPlotDigits);
  const std::string arrows =
      "using 1:2:($3 * " + times + "):($4 * " + times + ") with vectors nohead ";
  const std::string dots = "using 1:2 with points pointtype 7 pointsize 0.18";
  const std::string commands =
      format_data(plot) + plot_settings() +
      "set size ratio -1\n"
      "set xrange [-0.5:" +
      significant(width - 0.5, kPlotDigits) +
      "]\n"
      "set yrange [" +
      significant(height - 0.5, kPlotDigits) +
      ":-0.5]\n"  // v downwards, as in the image
      "set xlabel 'u (px)'\n"
      "set ylabel 'v (px)'\n"
      "set multiplot layout 2,2 margins 0.1,0.9,0.08,0.88 spacing 0.13,0.2 title " +
      gnuplot_quoted(plot.title) +
      " noenhanced\n"
      "set title " +
      gnuplot_quoted("corners of all views\n" + describe_counts(plot, " (crosses)")) + "\n" +
      layers(plot, dots, "using 1:2 with points pointtype 2 pointsize 1.2 linewidth 2") +
      "set title " +
      gnuplot_quoted("residuals, seen minus projected, " + times + " times as long\n" +
                     describe_counts(plot, " (thick)")) +
      "\n" +
      layers(plot, dots + " linecolor rgb '#0072b2' notitle, $corners " + arrows + "linewidth 0.5",
             arrows + "linewidth 2") +
      "set title 'uncertainty of the projection'\n" + format_sd_map(plot) + format_mtf50_map(plot) +
      "unset multiplot\n";
  return {"intrinsics", 900, 280 + 720 * height / width, commands};
}

}  // namespace vlp
