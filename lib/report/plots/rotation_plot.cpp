// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/rotation_plot.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "report/plots/plot_parts.h"

namespace vlp {
namespace {

/// Returns axis ranges of equal length that contain the box, with v downwards as in the image.
std::string format_square_range(const Eigen::AlignedBox2d& box) {
  constexpr double margin = 0.1, min_px = 1e-3;
  const Eigen::Vector2d center = box.center();
  const double half = (0.5 + margin) * std::max(box.sizes().maxCoeff(), min_px);
  return "set xrange " + plot_range(center.x() - half, center.x() + half) + "\nset yrange " +
         plot_range(center.y() + half, center.y() - half) + "\n";
}

}  // namespace

Drawing make_drawing(const RotationPlot& plot) {
  std::string places, ellipses, labels;
  std::set<int> labeled;
  Eigen::AlignedBox2d image, centers(plot.rotation_center_px);
  centers.extend(plot.principal_point_px);
  for (const auto& [lamp, places_px, center_px, radii_px] : plot.traces) {
    for (const auto& place : places_px)
      places += format_data_row({place.x(), place.y(), double(lamp)});
    ellipses += format_data_row(
        {center_px.x(), center_px.y(), 2 * radii_px.x(), 2 * radii_px.y(), double(lamp)});
    // One label per lamp, although it has an ellipse at each height.
    if (labeled.insert(lamp).second) {
      labels += format_data_row({center_px.x(), center_px.y(), double(lamp)});
    }
    image.extend(center_px - radii_px).extend(center_px + radii_px);
    centers.extend(center_px);
  }
  const Eigen::Vector2d &axis = plot.rotation_center_px, &principal = plot.principal_point_px;
  const std::string marks =
      "$principal using 1:2 with points pointtype 1 pointsize 2 linewidth 2 linecolor rgb "
      "'#0072b2' title 'principal point', "
      "$axis using 1:2 with points pointtype 2 pointsize 2 linewidth 2 linecolor rgb '#d55e00' "
      "title 'rotation center'\n";
  const std::string commands =
      data_block("places", places) + data_block("ellipses", ellipses) +
      data_block("labels", labels) + data_block("axis", format_data_row({axis.x(), axis.y()})) +
      data_block("principal", format_data_row({principal.x(), principal.y()})) + plot_settings() +
      "set size ratio -1\n"
      "set xlabel 'u (px)'\n"
      "set ylabel 'v (px)'\n"
      "unset colorbox\n"
      "set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#e0b000')\n"
      "set multiplot layout 1,2 title " +
      gnuplot_quoted(plot.title) +
      " noenhanced\n"
      "set title 'lamps while turning, undistorted image'\n" +
      format_square_range(image.extend(centers)) +
      "plot $ellipses using 1:2:3:4 with ellipses linecolor rgb '#999999' notitle, "
      "$places using 1:2:3 with points pointtype 7 pointsize 0.6 linecolor palette notitle, " +
      marks + "set title 'centers of the ellipses'\n" + format_square_range(centers) +
      "plot $ellipses using 1:2:5 with points pointtype 6 pointsize 1.2 linewidth 2 linecolor "
      "palette notitle, "
      "$labels using 1:2:(sprintf('%d', int($3))) with labels left offset 0.8,0 notitle, " +
      marks + "unset multiplot\n";
  return {"rotation", 1000, 560, commands};
}

}  // namespace vlp
