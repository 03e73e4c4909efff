// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/dispersion_plot.h"

#include "captures/csv_writer.h"
#include "evaluation/gnuplot.h"

namespace vlp {
namespace {

constexpr int kDigits = 6;

std::string mm(double value_m) { return significant(1e3 * value_m, kDigits); }

std::string points(const std::string& name, const std::vector<Eigen::Vector2d>& errors_m) {
  std::string block = "$" + name + " << END\n";
  for (const auto& error_m : errors_m) {
    block += mm(error_m.x());
    block += " ";
    block += mm(error_m.y());
    block += "\n";
  }
  return block + "END\n";
}

/// With the corners of the box around, because gnuplot's ranges leave circles out.
std::string circle(const std::string& name, const Circle& circle_m) {
  const Eigen::Vector2d half(circle_m.radius, circle_m.radius);
  const std::vector<Eigen::Vector2d> corners{circle_m.center - half, circle_m.center + half};
  return "$" + name + " << END\n" + mm(circle_m.center.x()) + " " + mm(circle_m.center.y()) + " " +
         mm(circle_m.radius) + "\nEND\n" + points(name + "_box", corners);
}

/// Points with their circle and its centre, for the plot command.
std::string layer(const std::string& name, const std::string& color, const std::string& title) {
  const std::string style = " linecolor rgb '" + color + "' ";
  return "$" + name + "_circle using 1:2:3 with circles linewidth 1.5" + style + "notitle, " + "$" +
         name + "_circle_box using 1:2 with points pointtype -1 notitle, $" + name +
         "_circle using 1:2 with points pointtype 2 pointsize 1.5 linewidth 2" + style +
         "notitle, $" + name + " using 1:2 with points pointtype 7 pointsize 0.8" + style +
         "title '" + title + "'";
}

}  // namespace

void draw_dispersion_plot(const std::filesystem::path& picture, const DispersionPlot& plot) {
  std::string commands =
      points("before", plot.before.errors_m) + circle("before_circle", plot.before.circle) +
      points("after", plot.after.errors_m) + circle("after_circle", plot.after.circle) +
      points("outliers", plot.outliers_m) +
      "set encoding utf8\n"
      "set title " +
      gnuplot_quoted(plot.title) +
      " noenhanced\n"
      "set xlabel 'fix minus station, x (mm)'\n"
      "set ylabel 'y (mm)'\n"
      "set size ratio -1\n"
      // The station always, and never an empty range.
      "set xrange [* < -0.01 : 0.01 < *]\n"
      "set yrange [* < -0.01 : 0.01 < *]\n"
      "set offsets graph 0.05, graph 0.05, graph 0.05, graph 0.05\n"
      "set tics out nomirror\n"
      "set grid linecolor rgb '#dddddd'\n"
      "set key below\n"
      "plot " +
      layer("before", "#3b528b", "before") + ", " + layer("after", "#d95f02", "after");
  if (!plot.outliers_m.empty()) {
    commands +=
        ", $outliers using 1:2 with points pointtype 4 linecolor rgb '#888888' title 'left out'";
  }
  commands +=
      ", '+' using (0):(0) every ::0::0 with points pointtype 1 pointsize 2 linewidth 2 linecolor "
      "rgb 'black' title 'station'\n";
  draw(picture, 800, 800, commands);
}

}  // namespace vlp
