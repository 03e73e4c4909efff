// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "report/plots/calibration_plots.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "captures/number_text.h"
#include "report/plots/plot_parts.h"

namespace vlp {
namespace {

std::string make_point_block(const std::string& name,
                             const std::vector<Eigen::Vector2d>& errors_m) {
  std::string rows;
  for (const auto& error_m : errors_m)
    rows += format_data_row({1e3 * error_m.x(), 1e3 * error_m.y()});
  return make_data_block(name, rows);
}

/// Returns a circle and the corners of its bounding box, because gnuplot's autoscaling ignores
/// circles.
std::string make_circle_blocks(const std::string& name, const Circle& circle_m) {
  const Eigen::Vector2d half(circle_m.radius, circle_m.radius);
  const std::vector<Eigen::Vector2d> corners{circle_m.center - half, circle_m.center + half};
  return make_data_block(name,
                         format_data_row({1e3 * circle_m.center.x(), 1e3 * circle_m.center.y(),
                                          1e3 * circle_m.radius})) +
         make_point_block(name + "_box", corners);
}

/// Returns the plot clauses of points with their circle and its center.
std::string make_gnuplot_layer(const std::string& name, const std::string& color,
                               const std::string& marker, const std::string& dashes) {
  const std::string style = make_color_clause(color);
  return "$" + name + "_circle using 1:2:3 with circles linewidth 1.5 dashtype " + dashes + style +
         "notitle, " + "$" + name + "_circle_box using 1:2 with points pointtype -1 notitle, $" +
         name + "_circle using 1:2 with points pointtype 2 pointsize 1.5 linewidth 2" + style +
         "notitle, $" + name + " using 1:2 with points pointtype " + marker + " pointsize 0.8" +
         style + "title '" + name + "'";
}

/// Returns axis ranges of equal length that contain the box, with v downwards as in the image.
std::string format_square_range(const Eigen::AlignedBox2d& box) {
  constexpr double margin = 0.1, min_px = 1e-3;
  const Eigen::Vector2d center = box.center();
  const double half = (0.5 + margin) * std::max(box.sizes().maxCoeff(), min_px);
  return "set xrange " + format_gnuplot_range(center.x() - half, center.x() + half) +
         "\nset yrange " + format_gnuplot_range(center.y() + half, center.y() - half) + "\n";
}

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
                 : format_digits(u, kPlotDigits) + " " + format_digits(v, kPlotDigits) + " NaN\n";
    }
    map += "\n";
  }
  return make_data_block("corners", corners) + make_data_block("outliers", outliers) +
         make_data_block("map", map);
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
std::string format_commands(const IntrinsicsPlot& plot, const std::string& corner_style,
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
  const auto levels = list_1_2_5_series(min_sd_px, max_sd_px);
  std::string tics, lines;
  for (const double level : levels) {
    const std::string text = format_digits(level, kPlotDigits);
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
                        format_digits((plot.imager_px[0] - 1) / 2.0 / (plot.cols - 1), kPlotDigits),
                    half_v = format_digits((plot.imager_px[1] - 1) / 2.0 / double(rows - 1),
                                           kPlotDigits);
  commands += "set cbrange [" + format_digits(levels.front(), kPlotDigits) + ":" +
              format_digits(levels.back(), kPlotDigits) + "]\nset cbtics (" + tics +
              ")\nset logscale cb\n"
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
  return make_data_block("mtf50", map) + "set title " +
         quote_for_gnuplot("sharpness: MTF50 of lens and pixel\ncycles per pixel") +
         "\nunset logscale cb\nset cbrange [0:*]\nset cbtics autofreq\nplot $mtf50 using 1:2:(" +
         format_digits(half_u, kPlotDigits) + "):(" + format_digits(half_v, kPlotDigits) +
         "):3 with boxxyerror fillstyle solid linecolor palette notitle\n";
}

}  // namespace

Drawing draw_dispersion(const DispersionPlot& plot) {
  std::string commands = make_point_block("before", plot.before.errors_m) +
                         make_circle_blocks("before_circle", plot.before.circle) +
                         make_point_block("after", plot.after.errors_m) +
                         make_circle_blocks("after_circle", plot.after.circle) +
                         make_point_block("outliers", plot.outliers_m) + make_settings() +
                         make_gnuplot_title_command(plot.title) +
                         "set xlabel 'fix minus reference point, x (mm)'\n"
                         "set ylabel 'y (mm)'\n"
                         "set size ratio -1\n"
                         // Contains the reference point always, and is never empty.
                         "set xrange [* < -0.01 : 0.01 < *]\n"
                         "set yrange [* < -0.01 : 0.01 < *]\n"
                         "set offsets graph 0.05, graph 0.05, graph 0.05, graph 0.05\n"
                         "plot " +
                         make_gnuplot_layer("before", plot_colors::blue, "8", "2") + ", " +
                         make_gnuplot_layer("after", plot_colors::vermilion, "7", "1");
  if (!plot.outliers_m.empty()) {
    commands += ", $outliers using 1:2 with points pointtype 4 linecolor rgb '" +
                std::string(plot_colors::gray) + "' title 'rejected'";
  }
  commands +=
      ", '+' using (0):(0) every ::0::0 with points pointtype 1 pointsize 2 linewidth 2 linecolor "
      "rgb 'black' title 'reference point'\n";
  return {"dispersion", 720, 720, commands};
}

Drawing draw_rotation(const RotationPlot& plot) {
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
      make_data_block("places", places) + make_data_block("ellipses", ellipses) +
      make_data_block("labels", labels) +
      make_data_block("axis", format_data_row({axis.x(), axis.y()})) +
      make_data_block("principal", format_data_row({principal.x(), principal.y()})) +
      make_settings() +
      "set size ratio -1\n"
      "set xlabel 'u (px)'\n"
      "set ylabel 'v (px)'\n"
      "unset colorbox\n"
      "set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#e0b000')\n"
      "set multiplot layout 1,2 title " +
      quote_for_gnuplot(plot.title) +
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

double choose_residual_scale(double rms_px, int width_px) {
  return rms_px > 0 ? round_down_to_1_2_5(width_px / 40.0 / rms_px) : 1;
}

Drawing draw_intrinsics(const IntrinsicsPlot& plot) {
  assert(plot.cols >= 2 && plot.sd_px.size() >= 2 * static_cast<std::size_t>(plot.cols));
  const auto [width, height] = plot.imager_px;
  const std::string times = format_digits(choose_residual_scale(rms_px(plot), width), kPlotDigits);
  const std::string arrows =
      "using 1:2:($3 * " + times + "):($4 * " + times + ") with vectors nohead ";
  const std::string dots = "using 1:2 with points pointtype 7 pointsize 0.18";
  const std::string commands =
      format_data(plot) + make_settings() +
      "set size ratio -1\n"
      "set xrange [-0.5:" +
      format_digits(width - 0.5, kPlotDigits) +
      "]\n"
      "set yrange [" +
      format_digits(height - 0.5, kPlotDigits) +
      ":-0.5]\n"  // v downwards, as in the image
      "set xlabel 'u (px)'\n"
      "set ylabel 'v (px)'\n"
      "set multiplot layout 2,2 margins 0.1,0.88,0.09,0.88 spacing 0.22,0.2 title " +
      quote_for_gnuplot(plot.title) +
      " noenhanced\n"
      "set title " +
      quote_for_gnuplot("corners of all views\n" + describe_counts(plot, " (crosses)")) + "\n" +
      format_commands(plot, dots, "using 1:2 with points pointtype 2 pointsize 1.2 linewidth 2") +
      "set title " +
      quote_for_gnuplot("residuals, seen minus projected, " + times + " times as long\n" +
                        describe_counts(plot, " (thick)")) +
      "\n" +
      format_commands(
          plot, dots + " linecolor rgb '#0072b2' notitle, $corners " + arrows + "linewidth 0.5",
          arrows + "linewidth 2") +
      "set title " + quote_for_gnuplot("uncertainty of the projection\nstandard deviation (px)") +
      "\n" + format_sd_map(plot) + format_mtf50_map(plot) + "unset multiplot\n";
  return {"intrinsics", 1000, 280 + 720 * height / width, commands};
}

IntrinsicsPlot make_intrinsics_plot(const std::string& title, const IntrinsicsSolution& solution,
                                    const BoardLattice& lattice,
                                    const std::optional<LensSharpness>& sharpness) {
  const BoardProblem& problem = solution.problem;
  IntrinsicsPlot plot{title, problem.imager_px, {}, 0, {}};
  const auto residuals_px = compute_board_residuals(problem);
  for (std::size_t i = 0; i < residuals_px.size(); ++i) {
    if (!residuals_px[i].allFinite()) continue;
    const Eigen::Vector3d& point = problem.points[i];
    plot.corners.push_back({point.head<2>(), residuals_px[i], point.z() <= 0});
  }
  const ProjectionUncertainty uncertainty(solution, lattice);
  for (const Eigen::Vector2d& pixel : make_pixel_grid(problem.imager_px)) {
    if (pixel.y() == 0) ++plot.cols;
    plot.sd_px.push_back(uncertainty.worst_direction_sd_px(pixel));
  }
  if (sharpness) {
    plot.mtf50_cols = sharpness->mtf50.cols;
    plot.mtf50 = sharpness->mtf50.values;
  }
  return plot;
}

RotationPlot make_rotation_plot(const std::string& title, const RotationCaptures& rotation,
                                const CircleCenters& circles, const RotationFit& fit,
                                const Camera& camera) {
  RotationPlot plot{
      title, {}, fit.center.center_px, ideal_pixel_from_point(camera, Eigen::Vector2d::Zero())};
  for (const auto& [lamp, height, circle] : circles.circles) {
    const Eigen::Vector2d radii_px = camera.focal_px();
    plot.traces.push_back({rotation.lamps[lamp].id,
                           {},
                           ideal_pixel_from_point(camera, circle.circle.center),
                           circle.circle.radius * radii_px});
    for (const RotationObservation& observation : rotation.observations) {
      if (observation.lamp != lamp || rotation.captures[observation.capture].height != height)
        continue;
      plot.traces.back().positions_px.push_back(
          ideal_pixel_from_point(camera, observation.ray.hnormalized()));
    }
  }
  return plot;
}

DispersionPlot make_dispersion_plot(const std::string& title, const DispersionFit& fit) {
  DispersionPlot plot{title, {{}, fit.before}, {{}, fit.after}, {}};
  for (const auto& fix : fit.fixes) {
    if (fix.used) {
      plot.before.errors_m.push_back(fix.before_m);
      plot.after.errors_m.push_back(fix.after_m);
    } else {
      plot.outliers_m.push_back(fix.before_m);
    }
  }
  return plot;
}

}  // namespace vlp
