// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/evaluation_pictures.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "positioning/floor_summary.h"
#include "positioning/unit_errors.h"
#include "report/plots/budget_plot.h"
#include "report/plots/cdf_plot.h"
#include "report/plots/error_plot.h"
#include "report/plots/round_numbers.h"
#include "report/plots/track_plot.h"

namespace vlp {
namespace {

Eigen::Vector2d place_m(const FixRow& row) { return row.fix->pose.position_m.head<2>(); }

ErrorPlot make_floor_plan(const EvaluationInput& input, const std::vector<FixError>& errors,
                          const LampMap& lamps) {
  ErrorPlot plot{"Fixes on the floor", {}, {}, lamps};
  std::vector<bool> found(input.truth ? input.truth->rows.size() : 0);
  plot.fixes.reserve(errors.size());
  for (const FixError& error : errors) {
    const Eigen::Vector2d fix_m = place_m(input.fixes.rows[error.fix]);
    plot.fixes.push_back({fix_m - error.horizontal_m, fix_m, input.fixes.rows[error.fix].image});
    if (input.truth) found[error.truth] = true;
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!found[i]) plot.missing_m.push_back(input.truth->rows[i].xy_m);
  }
  return plot;
}

}  // namespace

Drawing draw_floor_plan(const EvaluationInput& input, const LampMap& lamps) {
  return drawing_of(make_floor_plan(input, errors_of(input, input.fixes).errors, lamps));
}

std::vector<ReportPicture> evaluation_pictures(const EvaluationInput& input,
                                               const Evaluation& evaluation, const LampMap& lamps) {
  const std::vector<FixError> errors = errors_of(input, input.fixes).errors;
  std::vector<ReportPicture> pictures;
  if (!input.line_m) {
    pictures.push_back(report_picture(drawing_of(make_floor_plan(input, errors, lamps))));
  } else if (evaluation.fit) {
    pictures.push_back(drive_picture("Drive", input.fixes.rows, *input.line_m, *evaluation.fit));
  }
  CdfPlot::Curve curve{"fixes", {}, evaluation.horizontal_m.median, evaluation.horizontal_m.p90};
  curve.errors_m.reserve(errors.size());
  for (const FixError& error : errors) curve.errors_m.push_back(error.horizontal_m.norm());
  pictures.push_back(report_picture(drawing_of(CdfPlot{"Horizontal errors", {curve}})));
  pictures.back().alt += " Half of the fixes are no further off than " + in_mm(curve.p50_m) +
                         ", nine tenths no further than " + in_mm(curve.p90_m) + ".";
  return pictures;
}

std::optional<ReportPicture> budget_picture(const std::vector<FixRow>& fixes, const LampMap& lamps,
                                            const Calibration& calibration) {
  if (lamps.lamps.empty()) return std::nullopt;
  const UnitErrors unit(lamps, calibration);
  BudgetPlot plot{
      "Where the uncertainty comes from", {"noise", "lens", "zenith", "offset", "lamp map"}, {}};
  const auto horizontal = [](const Eigen::Vector4d& sd) { return sd.head<2>().squaredNorm(); };
  for (const FixRow& row : fixes) {
    if (!row.fix || !row.fix->sd || !row.fix->noise_sd || row.fix->inclination) continue;
    auto seen = unit.lamps_seen_from(row.fix->pose);
    std::erase_if(seen, [&](std::size_t lamp) {
      const auto& left_out = row.rejected;
      return std::find(left_out.begin(), left_out.end(), lamps.lamps[lamp].id) != left_out.end();
    });
    constexpr double any_px = 1;  // arbitrary: the proportions do not depend on it
    const auto budget = unit.budget(row.fix->pose, seen, any_px);
    if (!budget) continue;
    const double common_m = spread_of(budget->common()).horizontal_m;
    if (!(common_m > 0)) continue;
    const double noise_m2 = horizontal(*row.fix->noise_sd);
    const double stated_m2 = std::max(0.0, horizontal(*row.fix->sd) - noise_m2);
    const auto of = [&](const Matrix4& part) {
      const double share = spread_of(part).horizontal_m / common_m;
      return share * share * stated_m2;
    };
    plot.variances_m2.push_back(
        {noise_m2, of(budget->lens), of(budget->zenith), of(budget->offset), of(budget->lamp_map)});
  }
  if (plot.variances_m2.empty()) return std::nullopt;
  ReportPicture picture = report_picture(drawing_of(plot));
  const std::vector<double> shares = plot.shares();
  for (std::size_t i = 0; i < shares.size(); ++i) {
    picture.alt += fmt::format("{} {} {:.0f} %", i == 0 ? "" : ",", plot.parts[i], 100 * shares[i]);
  }
  picture.alt += ".";
  return picture;
}

ReportPicture drive_picture(const std::string& title, const std::vector<FixRow>& fixes,
                            const CommandedLine& commanded_m, const LineFit& fit) {
  TrackPlot plot{title, commanded_m, {}, fit.line_m};
  for (const FixRow& row : fixes) {
    if (row.fix) plot.fixes_m.push_back(place_m(row));
  }
  ReportPicture picture = report_picture(drawing_of(plot));
  picture.caption = title + ". " + picture.caption;
  picture.alt = title + ". " + picture.alt + " The fitted line is off by " +
                in_mm(fit.distances_m.mean) + " on average.";
  return picture;
}

}  // namespace vlp
