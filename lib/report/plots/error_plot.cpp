// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/error_plot.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "captures/number_text.h"
#include "report/plots/plot_parts.h"
#include "report/plots/round_numbers.h"
#include "report/plots/thinning.h"

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
std::vector<std::vector<std::string>> make_table(const ErrorPlot& plot) {
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
    table.push_back(
        {fix.image,
         fixed(fix.truth_m.x(), place_digits) + ", " + fixed(fix.truth_m.y(), place_digits),
         fixed(error_mm.x(), error_digits) + ", " + fixed(error_mm.y(), error_digits),
         fixed(error_mm.norm(), error_digits)});
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
    magnification = error_magnification(p90_m, width_m);
  }
  double longest_m() const { return kLongestShare * width_m / magnification; }
};

/// Data blocks of the plot. The constructor extends `scale.paper` by the arrows.
struct Blocks {
  std::string arrows, cut, places, missing, lamps;

  Blocks(const ErrorPlot& plot, std::size_t step, Scale& scale) {
    for (const std::size_t i :
         select_every_nth_and_largest(compute_lengths_m(plot), step, step > 1 ? kFurthest : 0)) {
      const Eigen::Vector2d& from_m = plot.fixes[i].truth_m;
      const double length_m = error_m(plot.fixes[i]), longest_m = scale.longest_m();
      Eigen::Vector2d arrow_m = scale.magnification * (plot.fixes[i].fix_m - from_m);
      if (length_m > longest_m) arrow_m *= longest_m / length_m;
      (length_m > longest_m ? cut : arrows) +=
          format_data_row({from_m.x(), from_m.y(), arrow_m.x(), arrow_m.y()});
      places += format_data_row({from_m.x(), from_m.y()});
      scale.extent.extend(from_m + arrow_m);
    }
    const std::size_t missing_step = thinning_step(plot.missing_m.size(), kMaxMissing);
    for (std::size_t i = 0; i < plot.missing_m.size(); i += missing_step) {
      missing += format_data_row({plot.missing_m[i].x(), plot.missing_m[i].y()});
    }
    for (const Lamp& lamp : plot.lamps.lamps) {
      lamps += format_data_row({lamp.position_m.x(), lamp.position_m.y(), double(lamp.id)});
    }
  }
  std::string text() const {
    return data_block("arrows", arrows) + data_block("cut", cut) + data_block("places", places) +
           data_block("missing", missing) + data_block("lamps", lamps);
  }
};

/// Returns a scale bar at the lower left, in the space below the plan.
std::string make_scale_bar(const Scale& scale, const Eigen::Vector2d& from_m) {
  if (!(scale.p90_m > 0)) return "";
  const double length_m = round_below(1.5 * scale.p90_m);
  const auto at = [&](double x_m) {
    return significant(x_m, 7) + "," + significant(from_m.y(), 7);
  };
  const double end_m = from_m.x() + scale.magnification * length_m;
  return "set arrow from " + at(from_m.x()) + " to " + at(end_m) +
         " heads size graph 0.01,90 linewidth 2 front\nset label '" +
         format_mm_with_unit(length_m) + "' at " + at(end_m) + " offset 1,0 front\n";
}

std::string layers(const ErrorPlot& plot, const Blocks& blocks, const Scale& scale) {
  const auto color = [](const char* name) { return std::string(" linecolor rgb '") + name + "' "; };
  const std::string arrow =
      " using 1:2:3:4 with vectors filled head size graph 0.012,20 linewidth ";
  const auto cut = std::count_if(plot.fixes.begin(), plot.fixes.end(),
                                 [&](const auto& fix) { return error_m(fix) > scale.longest_m(); });
  std::vector<std::string> layers;
  if (!blocks.arrows.empty()) {
    layers.push_back("$arrows" + arrow + "1.3" + color(plot_colors::blue) +
                     "title 'error of a fix'");
  }
  if (!blocks.places.empty()) {
    layers.emplace_back(
        "$places using 1:2 with points pointtype 7 pointsize 0.25 linecolor rgb 'black' title "
        "'truth'");
  }
  if (cut > 0) {
    layers.push_back("$cut" + arrow + "1.5 dashtype 2" + color(plot_colors::vermilion) + "title '" +
                     std::to_string(cut) + " beyond " + format_mm_with_unit(scale.longest_m()) +
                     ", cut short'");
  }
  if (!blocks.missing.empty()) {
    const std::size_t count = plot.missing_m.size(), step = thinning_step(count, kMaxMissing);
    layers.push_back(
        "$missing using 1:2 with points pointtype 2 linewidth 2" + color(plot_colors::vermilion) +
        "title 'no fix: " + (step == 1 ? std::to_string(count) : thinning_note(count, step)) + "'");
  }
  if (!blocks.lamps.empty()) {
    layers.push_back("$lamps using 1:2 with points pointtype 6 pointsize 1.6 linewidth 2" +
                     color(plot_colors::gray) +
                     "title 'lamps', $lamps using 1:2:(sprintf('%d', int($3))) with labels left "
                     "offset 1,0.7 notitle");
  }
  std::string command;
  for (const auto& layer : layers) command.append(command.empty() ? "plot " : ", ").append(layer);
  return command + "\n";
}

}  // namespace

double error_magnification(double p90_m, double width_m) {
  constexpr double largest_share = 0.1;
  return p90_m > 0 ? std::max(1.0, round_below(largest_share * width_m / p90_m)) : 1;
}

Drawing make_drawing(const ErrorPlot& plot) {
  Scale scale(plot);
  const std::size_t step = thinning_step(plot.fixes.size(), kMaxArrows);
  const Blocks blocks(plot, step, scale);
  const double margin_m = 0.06 * scale.width_m;
  const Eigen::Vector2d lower = scale.extent.min() - Eigen::Vector2d(margin_m, 2 * margin_m),
                        upper = scale.extent.max() + Eigen::Vector2d(margin_m, margin_m);
  std::string title =
      plot.title + "\nerrors drawn " + significant(scale.magnification, 6) + " times as long";
  const std::string note = thinning_note(plot.fixes.size(), step);
  if (!note.empty()) title += "; " + note + ", and the 20 largest";
  constexpr int width_px = 720, beside_px = 90, around_px = 180, smallest_px = 400,
                largest_px = 900;
  const double plan_px = (width_px - beside_px) * (upper.y() - lower.y()) / (upper.x() - lower.x());
  return {
      "errors", width_px,
      static_cast<int>(std::clamp<double>(plan_px + around_px, smallest_px, largest_px)),
      blocks.text() + plot_settings() + "set title " + gnuplot_quoted(title) + " noenhanced\n" +
          make_scale_bar(scale, {scale.extent.min().x(), scale.extent.min().y() - 1.2 * margin_m}) +
          "set xlabel 'x (m)'\nset ylabel 'y (m)'\nset size ratio -1\nset xrange " +
          plot_range(lower.x(), upper.x()) + "\nset yrange " + plot_range(lower.y(), upper.y()) +
          "\n" + layers(plot, blocks, scale),
      make_table(plot)};
}

}  // namespace vlp
