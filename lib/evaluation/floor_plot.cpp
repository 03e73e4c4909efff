// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/floor_plot.h"

#include "captures/csv_writer.h"
#include "evaluation/gnuplot.h"

namespace vlp {
namespace {

constexpr int kDigits = 6;

/// A row of numbers for gnuplot.
std::string data_row(std::initializer_list<double> values) {
  std::string row;
  for (const double value : values) row += significant(value, kDigits) + " ";
  return row + "\n";
}

}  // namespace

void draw_floor_plot(const std::filesystem::path& picture, const FloorPlot& plot,
                     const LampMap& lamps) {
  std::string commands = "$places << END\n";
  for (const auto& place : plot.places) {
    if (place.value) commands += data_row({place.xy_m.x(), place.xy_m.y(), *place.value});
  }
  commands += "END\n$lamps << END\n";
  for (const Lamp& lamp : lamps.lamps) {
    commands += data_row({lamp.position_m.x(), lamp.position_m.y(), double(lamp.id)});
  }
  const std::string half = significant(plot.step_m / 2, kDigits);
  commands +=
      "END\n"
      "set encoding utf8\n"
      "set title " +
      gnuplot_quoted(plot.title) +
      " noenhanced\n"
      "set cblabel " +
      gnuplot_quoted(plot.label) +
      " noenhanced\n"
      "set xlabel 'x (m)'\n"
      "set ylabel 'y (m)'\n"
      "set size ratio -1\n"
      "set offsets " +
      half + "," + half + "," + half + "," + half +
      "\n"
      "set autoscale fix\n"
      "set tics out nomirror\n"
      "set key below\n"
      "set style textbox opaque noborder margins 0.5,0.5\n"
      // Viridis: even in lightness, legible to the colour-blind and in grey.
      "set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#fde725')\n"
      "plot $places using 1:2:(" +
      half + "):(" + half +
      "):3 with boxxyerror fillstyle solid "
      "linecolor palette notitle, "
      "$lamps using 1:2 with points pointtype 7 pointsize 1.2 linecolor rgb 'white' notitle, "
      "$lamps using 1:2 with points pointtype 6 pointsize 1.2 linewidth 2 linecolor rgb 'black' "
      "title 'lamps', "
      "$lamps using 1:2:(sprintf('%d', int($3))) with labels boxed offset 0,1.2 notitle\n";
  draw(picture, 900, 700, commands);
}

}  // namespace vlp
