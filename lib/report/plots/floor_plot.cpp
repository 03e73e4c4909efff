// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/floor_plot.h"

#include "captures/number_text.h"
#include "evaluation/errors/floor_limits.h"
#include "report/plots/gnuplot.h"
#include "report/plots/plot_parts.h"

namespace vlp {

FloorPlot make_floor_plot(const FloorLimits& limits, const std::string& title, double step_m) {
  FloorPlot plot{title, "horizontal standard deviation (mm)", step_m, {}};
  for (const FloorLimits::Position& place : limits.positions) {
    plot.positions.push_back({place.camera.position_m.head<2>(), {}});
    if (place.covariances.empty()) continue;
    plot.positions.back().value = 1e3 * compute_fix_sds(place.total_pose_covariance()).horizontal_m;
  }
  return plot;
}

void write_floor_plot(const std::filesystem::path& file, const FloorPlot& plot,
                      const LampMap& lamps) {
  std::string places, on_floor;
  for (const auto& place : plot.positions) {
    if (place.value) places += format_data_row({place.xy_m.x(), place.xy_m.y(), *place.value});
  }
  for (const Lamp& lamp : lamps.lamps) {
    on_floor += format_data_row({lamp.position_m.x(), lamp.position_m.y(), double(lamp.id)});
  }
  const std::string half = format_digits(plot.step_m / 2, kPlotDigits);
  const std::string commands =
      make_data_block("places", places) + make_data_block("lamps", on_floor) + make_settings() +
      make_gnuplot_title_command(plot.title) + "set cblabel " + quote_for_gnuplot(plot.label) +
      " noenhanced\n"
      "set xlabel 'x (m)'\n"
      "set ylabel 'y (m)'\n"
      "set size ratio -1\n"
      "set offsets " +
      half + "," + half + "," + half + "," + half +
      "\n"
      "set autoscale fix\n"
      "plot $places using 1:2:(" +
      half + "):(" + half +
      "):3 with boxxyerror fillstyle solid "
      "linecolor palette notitle, "
      "$lamps using 1:2 with points pointtype 7 pointsize 1.2 linecolor rgb 'white' notitle, "
      "$lamps using 1:2 with points pointtype 6 pointsize 1.2 linewidth 2 linecolor rgb 'black' "
      "title 'lamps', "
      "$lamps using 1:2:(sprintf('%d', int($3))) with labels boxed offset 0,1.2 notitle\n";
  write_plot(file, {"limits", 900, 700, commands});
}

}  // namespace vlp
