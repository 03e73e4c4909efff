// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/track_plot.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>

#include "captures/number_text.h"
#include "report/plots/plot_parts.h"
#include "report/plots/round_numbers.h"
#include "report/plots/thinning.h"

namespace vlp {
namespace {

constexpr std::size_t kMaxFixes = 2000;

/// Coordinate frame of the commanded line: x from its start along it, y to its left.
struct LineFrame {
  Eigen::Vector2d start_m, along;

  explicit LineFrame(const std::array<Eigen::Vector2d, 2>& line_m)
      : start_m(line_m[0]), along((line_m[1] - line_m[0]).normalized()) {}

  Eigen::Vector2d to_line_frame(const Eigen::Vector2d& in_world_m) const {
    const Eigen::Vector2d from_start_m = in_world_m - start_m;
    return {along.dot(from_start_m), along.x() * from_start_m.y() - along.y() * from_start_m.x()};
  }
};

/// Returns x and y in the world, meters along the commanded line, and millimeters to its left.
std::string format_row(const LineFrame& frame, const Eigen::Vector2d& point_m) {
  const Eigen::Vector2d in_line_m = frame.to_line_frame(point_m);
  return format_data_row({point_m.x(), point_m.y(), in_line_m.x(), 1e3 * in_line_m.y()});
}

/// Returns the plot command of commanded line, fixes and fitted line for these data columns.
std::string layers(const std::string& columns) {
  const auto color = [](const char* name) { return std::string(" linecolor rgb '") + name + "' "; };
  return "plot $commanded using " + columns + " with lines linewidth 2 linecolor rgb 'black' " +
         "title 'commanded', $fixes using " + columns + " with points pointtype 7 pointsize 0.35" +
         color(plot_colors::blue) + "title 'fixes', $fitted using " + columns +
         " with lines linewidth 2 dashtype 2" + color(plot_colors::vermilion) +
         "title 'fitted line'\n";
}

/// Data of the plot and the area they cover, in the world and along the commanded line.
struct TrackData {
  std::string commanded, fixes, fitted;
  Eigen::AlignedBox2d floor, along{Eigen::Vector2d::Zero()};

  explicit TrackData(const TrackPlot& plot, std::size_t step) {
    const LineFrame frame(plot.commanded_m);
    for (const auto& point_m : plot.commanded_m) {
      commanded += format_row(frame, point_m);
      floor.extend(point_m);
      along.extend(frame.to_line_frame(point_m));
    }
    for (std::size_t i = 0; i < plot.fixes_m.size(); i += step) {
      fixes += format_row(frame, plot.fixes_m[i]);
      floor.extend(plot.fixes_m[i]);
      along.extend(frame.to_line_frame(plot.fixes_m[i]));
    }
    // The fitted line extends as far as the fixes, whatever its two points are. So a drive that
    // ends early is visible.
    const LineFrame fitted_frame(plot.fitted_m);
    const auto along_fitted_m = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      return fitted_frame.to_line_frame(a).x() < fitted_frame.to_line_frame(b).x();
    };
    const auto [first, last] =
        std::minmax_element(plot.fixes_m.begin(), plot.fixes_m.end(), along_fitted_m);
    for (const auto& end_m : {*first, *last}) {
      const Eigen::Vector2d foot_m =
          fitted_frame.start_m + fitted_frame.to_line_frame(end_m).x() * fitted_frame.along;
      fitted += format_row(frame, foot_m);
      floor.extend(foot_m);
      along.extend(frame.to_line_frame(foot_m));
    }
  }
};

}  // namespace

Drawing make_drawing(const TrackPlot& plot) {
  assert(plot.commanded_m[0] != plot.commanded_m[1] && plot.fitted_m[0] != plot.fitted_m[1]);
  assert(!plot.fixes_m.empty());
  const std::size_t step = thinning_step(plot.fixes_m.size(), kMaxFixes);
  const auto [commanded, fixes, fitted, floor, along] = TrackData(plot, step);
  constexpr double margin = 0.1;
  const double around_m = margin * floor.sizes().maxCoeff();
  const Eigen::Vector2d low = floor.min().array() - around_m, high = floor.max().array() + around_m;
  const Eigen::Vector2d sizes_m = high - low;
  const std::string tics = significant(round_below(sizes_m.maxCoeff() / 4), 7);
  constexpr double width_px = 620, around_px = 60, below_px = 430;
  constexpr double smallest_px = 60, largest_px = 420;
  const double plan_px = std::clamp(width_px * sizes_m.y() / sizes_m.x(), smallest_px, largest_px),
               height_px = around_px + plan_px + below_px;
  const auto from_bottom = [&](double y_px) { return significant(y_px / height_px, 4); };
  const double aside_mm = 1e3 * (along.sizes().y() * 0.15 + 1e-6);
  const std::string note = thinning_note(plot.fixes_m.size(), step);
  return {"track", 720, static_cast<int>(height_px),
          data_block("commanded", commanded) + data_block("fixes", fixes) +
              data_block("fitted", fitted) + plot_settings() + "set multiplot title " +
              gnuplot_quoted(note.empty() ? plot.title : plot.title + "\n" + note) +
              " noenhanced\n"
              "set lmargin at screen 0.12\nset rmargin at screen 0.98\nset bmargin at screen " +
              from_bottom(below_px) + "\nset tmargin at screen " + from_bottom(below_px + plan_px) +
              "\nset size ratio -1\nset xtics " + tics + "\nset ytics " + tics +
              "\nset xlabel 'x (m)'\nset ylabel 'y (m)'\nunset key\nset xrange " +
              plot_range(low.x(), high.x()) + "\nset yrange " + plot_range(low.y(), high.y()) +
              "\n" + layers("1:2") + "set bmargin at screen " + from_bottom(100) +
              "\nset tmargin at screen " + from_bottom(below_px - 85) +
              "\nset size noratio\nset xtics autofreq\nset ytics autofreq\nset key horizontal Left "
              "reverse center at screen 0.54, screen " +
              from_bottom(22) +
              " maxrows 1\nset "
              "xlabel 'along the commanded line (m)'\n"
              "set ylabel 'to its left (mm)'\nset xrange " +
              plot_range(along.min().x() - around_m, along.max().x() + around_m) + "\nset yrange " +
              plot_range(1e3 * along.min().y() - aside_mm, 1e3 * along.max().y() + aside_mm) +
              "\n" + layers("3:4") + "unset multiplot\n"};
}

}  // namespace vlp
