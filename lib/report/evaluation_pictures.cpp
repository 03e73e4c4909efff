// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/evaluation_pictures.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "evaluation/errors/floor_limits.h"
#include "evaluation/errors/unit_errors.h"
#include "report/plots/evaluation_plots.h"
#include "report/plots/plot_parts.h"

namespace vlp {
namespace {

Eigen::Vector2d get_fix_position_m(const FixRow& row) { return row.fix->pose.position_m.head<2>(); }

ErrorPlot make_floor_plan(const EvaluationInput& input, const std::vector<FixError>& errors,
                          const LampMap& lamps) {
  ErrorPlot plot{"Fixes on the floor", {}, {}, lamps};
  std::vector<bool> has_fix(input.truth ? input.truth->rows.size() : 0);
  plot.fixes.reserve(errors.size());
  for (const FixError& error : errors) {
    const Eigen::Vector2d fix_m = get_fix_position_m(input.fixes.rows[error.fix]);
    plot.fixes.push_back({fix_m - error.horizontal_m, fix_m, input.fixes.rows[error.fix].image});
    if (input.truth) has_fix[error.truth] = true;
  }
  for (std::size_t i = 0; i < has_fix.size(); ++i) {
    if (!has_fix[i]) plot.missing_m.push_back(input.truth->rows[i].xy_m);
  }
  return plot;
}

}  // namespace

Drawing draw_floor_plan(const EvaluationInput& input, const LampMap& lamps) {
  return draw_fix_errors(
      make_floor_plan(input, compute_fix_errors(input, input.fixes).errors, lamps));
}

std::vector<ReportPlot> make_error_plots(const EvaluationInput& input, const Evaluation& evaluation,
                                         const LampMap& lamps) {
  const std::vector<FixError> errors = compute_fix_errors(input, input.fixes).errors;
  std::vector<ReportPlot> pictures;
  if (!input.line_m) {
    pictures.push_back(make_report_plot(draw_fix_errors(make_floor_plan(input, errors, lamps))));
  } else if (evaluation.line_fit) {
    pictures.push_back(
        make_drive_plot("Drive", input.fixes.rows, *input.line_m, *evaluation.line_fit));
  }
  CdfPlot::Curve curve{"fixes", {}, evaluation.horizontal_m.median, evaluation.horizontal_m.p90};
  curve.errors_m.reserve(errors.size());
  for (const FixError& error : errors) curve.errors_m.push_back(error.horizontal_m.norm());
  pictures.push_back(make_report_plot(draw_error_cdf(CdfPlot{"Horizontal errors", {curve}})));
  pictures.back().alt += " The median error is " + format_with_mm(curve.p50_m) +
                         ", nine tenths no further than " + format_with_mm(curve.p90_m) + ".";
  return pictures;
}

std::optional<ReportPlot> make_budget_plot(const std::vector<FixRow>& fixes, const LampMap& lamps,
                                           const Calibration& calibration) {
  if (lamps.lamps.empty()) return std::nullopt;
  const UnitErrors unit(lamps, calibration);
  BudgetPlot plot{
      "Where the uncertainty comes from", {"noise", "lens", "zenith", "offset", "lamp map"}, {}};
  const auto horizontal = [](const Eigen::Vector4d& sd) { return sd.head<2>().squaredNorm(); };
  for (const FixRow& row : fixes) {
    if (!row.fix || !row.fix->sd || !row.fix->noise_sd || row.fix->inclination) continue;
    auto visible = unit.list_visible_lamps(row.fix->pose);
    std::erase_if(visible, [&](std::size_t lamp) {
      const auto& rejected = row.rejected_lamps;
      return std::find(rejected.begin(), rejected.end(), lamps.lamps[lamp].id) != rejected.end();
    });
    constexpr double arbitrary_px = 1;  // arbitrary: the proportions do not depend on it
    const auto budget = unit.compute_budget(row.fix->pose, visible, arbitrary_px);
    if (!budget) continue;
    const double common_m = compute_fix_sds(budget->common_covariance()).horizontal_m;
    if (!(common_m > 0)) continue;
    const double noise_m2 = horizontal(*row.fix->noise_sd);
    const double stated_m2 = std::max(0.0, horizontal(*row.fix->sd) - noise_m2);
    const auto part_variance_m2 = [&](const Matrix4& part) {
      const double fraction = compute_fix_sds(part).horizontal_m / common_m;
      return fraction * fraction * stated_m2;
    };
    plot.variances_m2.push_back({noise_m2, part_variance_m2(budget->lens),
                                 part_variance_m2(budget->zenith), part_variance_m2(budget->offset),
                                 part_variance_m2(budget->lamp_map)});
  }
  if (plot.variances_m2.empty()) return std::nullopt;
  ReportPlot picture = make_report_plot(draw_budget(plot));
  const std::vector<double> fractions = plot.compute_fractions();
  for (std::size_t i = 0; i < fractions.size(); ++i) {
    picture.alt +=
        fmt::format("{} {} {:.0f} %", i == 0 ? "" : ",", plot.parts[i], 100 * fractions[i]);
  }
  picture.alt += ".";
  return picture;
}

ReportPlot make_drive_plot(const std::string& title, const std::vector<FixRow>& fixes,
                           const CommandedLine& commanded_m, const LineFit& fit) {
  TrackPlot plot{title, commanded_m, {}, fit.line_m};
  for (const FixRow& row : fixes) {
    if (row.fix) plot.fixes_m.push_back(get_fix_position_m(row));
  }
  ReportPlot picture = make_report_plot(draw_line_drive(plot));
  picture.caption = title + ". " + picture.caption;
  picture.alt = title + ". " + picture.alt + " The fitted line is off by " +
                format_with_mm(fit.distances_m.mean) + " on average.";
  return picture;
}

}  // namespace vlp
