// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "report/plots/evaluation_plots.h"

#include <fmt/core.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <numeric>

#include "captures/number_text.h"
#include "report/plots/plot_parts.h"

namespace vlp {
namespace {

constexpr std::size_t kMaxArrows = 500, kFurthest = 20, kMaxMissing = 200;
constexpr double kLongestShare = 0.25;

double error_m(const ErrorPlot::Fix& fix) { return (fix.fix_m - fix.truth_m).norm(); }

std::vector<double> compute_lengths_m(const ErrorPlot& plot) {
  std::vector<double> errors_m;
  errors_m.reserve(plot.fixes.size());
  for (const auto& fix : plot.fixes) errors_m.push_back(error_m(fix));
  return errors_m;
}

/// Makes the table of the largest errors, in descending order.
std::vector<std::vector<std::string>> make_error_table(const ErrorPlot& plot) {
  constexpr std::size_t max_rows = 10;
  constexpr int place_digits = 3, error_digits = 2;
  constexpr double millimeters = 1e3;
  std::vector<ErrorPlot::Fix> fixes = plot.fixes;
  const std::size_t count = std::min(max_rows, fixes.size());
  std::partial_sort(fixes.begin(), fixes.begin() + static_cast<std::ptrdiff_t>(count), fixes.end(),
                    [](const auto& a, const auto& b) { return error_m(a) > error_m(b); });
  std::vector<std::vector<std::string>> table;
  table.reserve(count + 1);
  if (count > 0) {
    table.push_back(
        {"largest errors", "x, y of the truth (m)", "error in x, y (mm)", "error (mm)"});
  }
  for (std::size_t i = 0; i < count; ++i) {
    const ErrorPlot::Fix& fix = fixes[i];
    const Eigen::Vector2d error_mm = millimeters * (fix.fix_m - fix.truth_m);
    table.push_back({fix.image,
                     format_fixed_decimals(fix.truth_m.x(), place_digits) + ", " +
                         format_fixed_decimals(fix.truth_m.y(), place_digits),
                     format_fixed_decimals(error_mm.x(), error_digits) + ", " +
                         format_fixed_decimals(error_mm.y(), error_digits),
                     format_fixed_decimals(error_mm.norm(), error_digits)});
  }
  return table;
}

/// Returns the 90th percentile of the errors; 0 if there are none.
double compute_p90(std::vector<double> errors_m) {
  if (errors_m.empty()) return 0;
  const auto nth = errors_m.begin() + static_cast<std::ptrdiff_t>((errors_m.size() - 1) * 9 / 10);
  std::nth_element(errors_m.begin(), nth, errors_m.end());
  return *nth;
}

/// Width of the plan, magnification of the arrows, and the area that contains them all.
struct Scale {
  double width_m, p90_m, magnification;
  Eigen::AlignedBox2d extent;

  explicit Scale(const ErrorPlot& plot) : p90_m(compute_p90(compute_lengths_m(plot))) {
    for (const auto& fix : plot.fixes) extent.extend(fix.truth_m);
    for (const auto& place_m : plot.missing_m) extent.extend(place_m);
    for (const Lamp& lamp : plot.lamps.lamps) extent.extend(lamp.position_m.head<2>());
    if (extent.isEmpty()) extent.extend(Eigen::Vector2d::Zero());
    constexpr double min_m = 1e-3;
    width_m = std::max(extent.sizes().maxCoeff(), min_m);
    magnification = choose_error_scale(p90_m, width_m);
  }
  double compute_longest_arrow_m() const { return kLongestShare * width_m / magnification; }
};

/// Data blocks of the plot. The constructor extends `scale.paper` by the arrows.
struct Blocks {
  std::string arrows, cut, places, missing, lamps;

  Blocks(const ErrorPlot& plot, std::size_t step, Scale& scale) {
    for (const std::size_t i :
         thin_out_indices(compute_lengths_m(plot), step, step > 1 ? kFurthest : 0)) {
      const Eigen::Vector2d& from_m = plot.fixes[i].truth_m;
      const double length_m = error_m(plot.fixes[i]), longest_m = scale.compute_longest_arrow_m();
      Eigen::Vector2d arrow_m = scale.magnification * (plot.fixes[i].fix_m - from_m);
      if (length_m > longest_m) arrow_m *= longest_m / length_m;
      (length_m > longest_m ? cut : arrows) +=
          format_data_row({from_m.x(), from_m.y(), arrow_m.x(), arrow_m.y()});
      places += format_data_row({from_m.x(), from_m.y()});
      scale.extent.extend(from_m + arrow_m);
    }
    const std::size_t missing_step = compute_thinning_step(plot.missing_m.size(), kMaxMissing);
    for (std::size_t i = 0; i < plot.missing_m.size(); i += missing_step) {
      missing += format_data_row({plot.missing_m[i].x(), plot.missing_m[i].y()});
    }
    for (const Lamp& lamp : plot.lamps.lamps) {
      lamps += format_data_row({lamp.position_m.x(), lamp.position_m.y(), double(lamp.id)});
    }
  }
  std::string text() const {
    return make_data_block("arrows", arrows) + make_data_block("cut", cut) +
           make_data_block("places", places) + make_data_block("missing", missing) +
           make_data_block("lamps", lamps);
  }
};

/// Returns a scale bar at the lower left, in the space below the plan.
std::string make_scale_bar(const Scale& scale, const Eigen::Vector2d& from_m) {
  if (!(scale.p90_m > 0)) return "";
  const double length_m = round_down_to_1_2_5(1.5 * scale.p90_m);
  const auto at = [&](double x_m) {
    return format_digits(x_m, 7) + "," + format_digits(from_m.y(), 7);
  };
  const double end_m = from_m.x() + scale.magnification * length_m;
  return "set arrow from " + at(from_m.x()) + " to " + at(end_m) +
         " heads size graph 0.01,90 linewidth 2 front\nset label '" + format_with_mm(length_m) +
         "' at " + at(end_m) + " offset 1,0 front\n";
}

std::string format_commands(const ErrorPlot& plot, const Blocks& blocks, const Scale& scale) {
  const std::string arrow =
      " using 1:2:3:4 with vectors filled head size graph 0.012,20 linewidth ";
  const auto cut = std::count_if(plot.fixes.begin(), plot.fixes.end(), [&](const auto& fix) {
    return error_m(fix) > scale.compute_longest_arrow_m();
  });
  std::vector<std::string> layers;
  if (!blocks.arrows.empty()) {
    layers.push_back("$arrows" + arrow + "1.3" + make_color_clause(plot_colors::blue) +
                     "title 'error of a fix'");
  }
  if (!blocks.places.empty()) {
    layers.emplace_back(
        "$places using 1:2 with points pointtype 7 pointsize 0.25 linecolor rgb 'black' title "
        "'truth'");
  }
  if (cut > 0) {
    layers.push_back("$cut" + arrow + "1.5 dashtype 2" + make_color_clause(plot_colors::vermilion) +
                     "title '" + std::to_string(cut) + " beyond " +
                     format_with_mm(scale.compute_longest_arrow_m()) + ", cut short'");
  }
  if (!blocks.missing.empty()) {
    const std::size_t count = plot.missing_m.size(),
                      step = compute_thinning_step(count, kMaxMissing);
    layers.push_back("$missing using 1:2 with points pointtype 2 linewidth 2" +
                     make_color_clause(plot_colors::vermilion) + "title 'no fix: " +
                     (step == 1 ? std::to_string(count) : describe_thinning(count, step)) + "'");
  }
  if (!blocks.lamps.empty()) {
    layers.push_back("$lamps using 1:2 with points pointtype 6 pointsize 1.6 linewidth 2" +
                     make_color_clause(plot_colors::gray) +
                     "title 'lamps', $lamps using 1:2:(sprintf('%d', int($3))) with labels left "
                     "offset 1,0.7 notitle");
  }
  std::string command;
  for (const auto& layer : layers) command.append(command.empty() ? "plot " : ", ").append(layer);
  return command + "\n";
}

constexpr std::size_t kMaxSteps = 500;
constexpr std::array<const char*, 4> kColors = {plot_colors::blue, plot_colors::vermilion,
                                                plot_colors::green, plot_colors::purple};

/// Returns rows of error in mm and cumulative fraction in percent.
std::string format_cdf_steps(std::vector<double> errors_m) {
  std::sort(errors_m.begin(), errors_m.end());
  const std::size_t count = errors_m.size(), steps = std::min(count, kMaxSteps);
  std::string rows = format_data_row({0, 0});
  for (std::size_t i = 1; i <= steps; ++i) {
    const std::size_t rank = count * i / steps;
    rows += format_data_row({1e3 * errors_m[rank - 1], 100 * double(rank) / double(count)});
  }
  return rows;
}

/// Returns the data blocks of a curve: its steps and its two marks.
std::string format_cdf_blocks(const CdfPlot::Curve& curve, const std::string& number) {
  return make_data_block("curve" + number, format_cdf_steps(curve.errors_m)) +
         make_data_block("marks" + number, format_data_row({1e3 * curve.p50_m, 50}) +
                                               format_data_row({1e3 * curve.p90_m, 90}));
}

std::string format_layer(const CdfPlot::Curve& curve, std::size_t i) {
  const std::string number = std::to_string(i),
                    color = make_color_clause(kColors[i % kColors.size()]),
                    style = " dashtype " + std::to_string(i + 1) + color,
                    label = curve.label + ": p50 " + format_mm(curve.p50_m) + " mm, p90 " +
                            format_mm(curve.p90_m) + " mm";
  return "$curve" + number + " using 1:2 with steps linewidth 2.5" + style + "title " +
         quote_for_gnuplot(label) + " noenhanced, $marks" + number +
         " using 1:2 with points pointtype " + std::to_string(5 + 2 * (i % kColors.size())) +
         " pointsize 1.3" + color + "notitle";
}

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
std::string format_commands(const std::string& columns) {
  return "plot $commanded using " + columns + " with lines linewidth 2 linecolor rgb 'black' " +
         "title 'commanded', $fixes using " + columns + " with points pointtype 7 pointsize 0.35" +
         make_color_clause(plot_colors::blue) + "title 'fixes', $fitted using " + columns +
         " with lines linewidth 2 dashtype 2" + make_color_clause(plot_colors::vermilion) +
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

constexpr std::size_t kMaxColumns = 200;
constexpr std::array<const char*, 5> kPartColors{plot_colors::gray, plot_colors::blue,
                                                 plot_colors::green, plot_colors::purple,
                                                 plot_colors::vermilion};

double sum_variances(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Returns one line per column: the variances in mm^2.
std::string format_columns(const BudgetPlot& plot) {
  auto fixes = plot.variances_m2;
  std::stable_sort(fixes.begin(), fixes.end(), [](const auto& a, const auto& b) {
    return sum_variances(a) < sum_variances(b);
  });
  const std::size_t columns = std::min(fixes.size(), kMaxColumns);
  std::string rows;
  for (std::size_t i = 1; i <= columns; ++i) {
    for (const double variance_m2 : fixes[fixes.size() * i / columns - 1]) {
      rows.append(format_digits(1e6 * variance_m2, kPlotDigits)).append(" ");
    }
    rows.append("\n");
  }
  return rows;
}

}  // namespace

double choose_error_scale(double p90_m, double width_m) {
  constexpr double largest_share = 0.1;
  return p90_m > 0 ? std::max(1.0, round_down_to_1_2_5(largest_share * width_m / p90_m)) : 1;
}

Drawing draw_fix_errors(const ErrorPlot& plot) {
  Scale scale(plot);
  const std::size_t step = compute_thinning_step(plot.fixes.size(), kMaxArrows);
  const Blocks blocks(plot, step, scale);
  const double margin_m = 0.06 * scale.width_m;
  const Eigen::Vector2d lower = scale.extent.min() - Eigen::Vector2d(margin_m, 2 * margin_m),
                        upper = scale.extent.max() + Eigen::Vector2d(margin_m, margin_m);
  std::string title =
      plot.title + "\nerrors drawn " + format_digits(scale.magnification, 6) + " times as long";
  const std::string note = describe_thinning(plot.fixes.size(), step);
  if (!note.empty()) title += "; " + note + ", and the 20 largest";
  constexpr int width_px = 720, beside_px = 90, around_px = 180, smallest_px = 400,
                largest_px = 900;
  const double plan_px = (width_px - beside_px) * (upper.y() - lower.y()) / (upper.x() - lower.x());
  return {
      "errors", width_px,
      static_cast<int>(std::clamp<double>(plan_px + around_px, smallest_px, largest_px)),
      blocks.text() + make_settings() + make_gnuplot_title_command(title) +
          make_scale_bar(scale, {scale.extent.min().x(), scale.extent.min().y() - 1.2 * margin_m}) +
          "set xlabel 'x (m)'\nset ylabel 'y (m)'\nset size ratio -1\nset xrange " +
          format_gnuplot_range(lower.x(), upper.x()) + "\nset yrange " +
          format_gnuplot_range(lower.y(), upper.y()) + "\n" + format_commands(plot, blocks, scale),
      make_error_table(plot)};
}

Drawing draw_error_cdf(const CdfPlot& plot) {
  assert(!plot.curves.empty());
  constexpr double off_the_picture = 4, margin = 1.05;
  double largest_m = 0, largest_p90_m = 0;
  for (const auto& curve : plot.curves) {
    largest_m =
        std::max(largest_m, *std::max_element(curve.errors_m.begin(), curve.errors_m.end()));
    largest_p90_m = std::max(largest_p90_m, curve.p90_m);
  }
  const bool cut = largest_p90_m > 0 && largest_m > off_the_picture * largest_p90_m;
  const double range_m = cut ? off_the_picture * largest_p90_m : std::max(largest_m, 1e-6);

  std::string blocks, layers;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    blocks += format_cdf_blocks(plot.curves[i], std::to_string(i));
    layers.append(layers.empty() ? "plot " : ", ").append(format_layer(plot.curves[i], i));
  }
  const std::string beyond =
      cut ? "; the largest, " + format_mm(largest_m) + " mm, is outside the plot" : "";
  return {"cdf", 720, 460 + 24 * static_cast<int>(plot.curves.size()),
          blocks + make_settings() + make_gnuplot_title_command(plot.title) +
              "set xlabel 'horizontal error (mm)" + beyond +
              "'\n"
              "set ylabel 'fixes with at most this error (%)'\n"
              "set key vertical maxrows " +
              std::to_string(plot.curves.size()) + "\nset xrange " +
              format_gnuplot_range(0, 1e3 * margin * range_m) +
              "\nset yrange [0:102]\nset ytics (0, 25, 50, 75, 90, 100)\n" + layers + "\n"};
}

Drawing draw_line_drive(const TrackPlot& plot) {
  assert(plot.commanded_m[0] != plot.commanded_m[1] && plot.fitted_m[0] != plot.fitted_m[1]);
  assert(!plot.fixes_m.empty());
  const std::size_t step = compute_thinning_step(plot.fixes_m.size(), kMaxFixes);
  const auto [commanded, fixes, fitted, floor, along] = TrackData(plot, step);
  constexpr double margin = 0.1;
  const double around_m = margin * floor.sizes().maxCoeff();
  const Eigen::Vector2d low = floor.min().array() - around_m, high = floor.max().array() + around_m;
  const Eigen::Vector2d sizes_m = high - low;
  const std::string tics = format_digits(round_down_to_1_2_5(sizes_m.maxCoeff() / 4), 7);
  constexpr double width_px = 620, around_px = 60, below_px = 430;
  constexpr double smallest_px = 60, largest_px = 420;
  const double plan_px = std::clamp(width_px * sizes_m.y() / sizes_m.x(), smallest_px, largest_px),
               height_px = around_px + plan_px + below_px;
  const auto from_bottom = [&](double y_px) { return format_digits(y_px / height_px, 4); };
  const double aside_mm = 1e3 * (along.sizes().y() * 0.15 + 1e-6);
  const std::string note = describe_thinning(plot.fixes_m.size(), step);
  return {
      "track", 720, static_cast<int>(height_px),
      make_data_block("commanded", commanded) + make_data_block("fixes", fixes) +
          make_data_block("fitted", fitted) + make_settings() + "set multiplot title " +
          quote_for_gnuplot(note.empty() ? plot.title : plot.title + "\n" + note) +
          " noenhanced\n"
          "set lmargin at screen 0.12\nset rmargin at screen 0.98\nset bmargin at screen " +
          from_bottom(below_px) + "\nset tmargin at screen " + from_bottom(below_px + plan_px) +
          "\nset size ratio -1\nset xtics " + tics + "\nset ytics " + tics +
          "\nset xlabel 'x (m)'\nset ylabel 'y (m)'\nunset key\nset xrange " +
          format_gnuplot_range(low.x(), high.x()) + "\nset yrange " +
          format_gnuplot_range(low.y(), high.y()) + "\n" + format_commands("1:2") +
          "set bmargin at screen " + from_bottom(100) + "\nset tmargin at screen " +
          from_bottom(below_px - 85) +
          "\nset size noratio\nset xtics autofreq\nset ytics autofreq\nset key horizontal Left "
          "reverse center at screen 0.54, screen " +
          from_bottom(22) +
          " maxrows 1\nset "
          "xlabel 'along the commanded line (m)'\n"
          "set ylabel 'to its left (mm)'\nset xrange " +
          format_gnuplot_range(along.min().x() - around_m, along.max().x() + around_m) +
          "\nset yrange " +
          format_gnuplot_range(1e3 * along.min().y() - aside_mm, 1e3 * along.max().y() + aside_mm) +
          "\n" + format_commands("3:4") + "unset multiplot\n"};
}

std::vector<double> BudgetPlot::compute_fractions() const {
  std::vector<double> fractions(parts.size());
  double whole = 0;
  for (const auto& fix : variances_m2) {
    for (std::size_t i = 0; i < fix.size(); ++i) fractions[i] += fix[i];
    whole += sum_variances(fix);
  }
  for (double& fraction : fractions) fraction /= whole;
  return fractions;
}

Drawing draw_budget(const BudgetPlot& plot) {
  assert(!plot.variances_m2.empty() && plot.parts.size() <= kPartColors.size());
  const std::vector<double> fractions = plot.compute_fractions();
  std::string layers;
  for (std::size_t i = 0; i < plot.parts.size(); ++i) {
    if (!(fractions[i] > 0)) continue;
    const std::string label = fmt::format("{}, {:.0f} %", plot.parts[i], 100 * fractions[i]);
    layers += fmt::format("{}$budget using {} linecolor rgb '{}' title {} noenhanced",
                          layers.empty() ? "plot " : ", ", i + 1, kPartColors[i],
                          quote_for_gnuplot(label));
  }
  return {"budget", 720, 520,
          make_data_block("budget", format_columns(plot)) + make_settings() +
              make_gnuplot_title_command(plot.title) +
              "set xlabel 'fixes, the most certain first'\n"
              "set ylabel 'horizontal variance (mm²)'\n"
              "set style data histograms\n"
              "set style histogram rowstacked\n"
              "set style fill solid 1 border rgb 'white'\n"
              "set boxwidth 1\n"
              "set yrange [0:*]\n"
              "unset xtics\n" +
              layers + "\n"};
}

}  // namespace vlp
