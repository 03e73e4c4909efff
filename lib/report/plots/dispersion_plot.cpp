// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/dispersion_plot.h"

#include "report/plots/plot_parts.h"

namespace vlp {
namespace {

std::string points(const std::string& name, const std::vector<Eigen::Vector2d>& errors_m) {
  std::string rows;
  for (const auto& error_m : errors_m)
    rows += format_data_row({1e3 * error_m.x(), 1e3 * error_m.y()});
  return data_block(name, rows);
}

/// Returns a circle and the corners of its bounding box, because gnuplot's autoscaling ignores
/// circles.
std::string circle(const std::string& name, const Circle& circle_m) {
  const Eigen::Vector2d half(circle_m.radius, circle_m.radius);
  const std::vector<Eigen::Vector2d> corners{circle_m.center - half, circle_m.center + half};
  return data_block(name, format_data_row({1e3 * circle_m.center.x(), 1e3 * circle_m.center.y(),
                                           1e3 * circle_m.radius})) +
         points(name + "_box", corners);
}

/// Returns the plot clauses of points with their circle and its center.
std::string layer(const std::string& name, const std::string& color, const std::string& marker,
                  const std::string& dashes) {
  const std::string style = " linecolor rgb '" + color + "' ";
  return "$" + name + "_circle using 1:2:3 with circles linewidth 1.5 dashtype " + dashes + style +
         "notitle, " + "$" + name + "_circle_box using 1:2 with points pointtype -1 notitle, $" +
         name + "_circle using 1:2 with points pointtype 2 pointsize 1.5 linewidth 2" + style +
         "notitle, $" + name + " using 1:2 with points pointtype " + marker + " pointsize 0.8" +
         style + "title '" + name + "'";
}

}  // namespace

Drawing make_drawing(const DispersionPlot& plot) {
  std::string commands =
      points("before", plot.before.errors_m) + circle("before_circle", plot.before.circle) +
      points("after", plot.after.errors_m) + circle("after_circle", plot.after.circle) +
      points("outliers", plot.outliers_m) + plot_settings() + "set title " +
      gnuplot_quoted(plot.title) +
      " noenhanced\n"
      "set xlabel 'fix minus station, x (mm)'\n"
      "set ylabel 'y (mm)'\n"
      "set size ratio -1\n"
      // Contains the reference point always, and is never empty.
      "set xrange [* < -0.01 : 0.01 < *]\n"
      "set yrange [* < -0.01 : 0.01 < *]\n"
      "set offsets graph 0.05, graph 0.05, graph 0.05, graph 0.05\n"
      "plot " +
      layer("before", plot_colors::blue, "8", "2") + ", " +
      layer("after", plot_colors::vermilion, "7", "1");
  if (!plot.outliers_m.empty()) {
    commands += ", $outliers using 1:2 with points pointtype 4 linecolor rgb '" +
                std::string(plot_colors::gray) + "' title 'left out'";
  }
  commands +=
      ", '+' using (0):(0) every ::0::0 with points pointtype 1 pointsize 2 linewidth 2 linecolor "
      "rgb 'black' title 'station'\n";
  return {"dispersion", 720, 720, commands};
}

}  // namespace vlp
