// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "calibration/intrinsics/projection_difference.h"
#include "report/evaluation_pictures.h"
#include "session/dispersion_step.h"
#include "session/evaluate_step.h"
#include "session/locate_step.h"
#include "session/session_folder.h"

namespace vlp {
namespace {

constexpr double kMillimetersPerMeter = 1e3;

/// Adds three fractions: captures with a fix, detections used by fixes, and lamps of the map that
/// were detected.
void add_check_fractions(const LocateResult& located, const std::vector<Frame>& frames,
                         const LampMap& map, StepResult& result) {
  std::set<int> seen;
  std::size_t lamps = 0, num_inliers = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    lamps += frames[i].detections.size();
    for (const Detection& detection : frames[i].detections) seen.insert(detection.lamp);
    if (located.fixes[i].has_succeeded())
      num_inliers += static_cast<std::size_t>(located.fixes[i].lamps);
  }
  const auto ratio = [](std::size_t part, std::size_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
  };
  result.metrics = {{"check_fix_fraction", ratio(located.summary.fixes, frames.size())},
                    {"check_lamp_inlier_fraction", ratio(num_inliers, lamps)},
                    {"check_lamps_seen", ratio(seen.size(), map.lamps.size())}};
}

void add_error_metrics(const EvaluationInput& input, const Evaluation& evaluation,
                       StepResult& result) {
  result.metrics.push_back({"check_mean_mm", kMillimetersPerMeter * evaluation.horizontal_m.mean});
  result.metrics.push_back({"check_worst_mm", kMillimetersPerMeter * evaluation.horizontal_m.max});
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  for (const FixError& error : compute_fix_errors(input, input.fixes).errors)
    sum_m += error.horizontal_m;
  const double offset_m = sum_m.norm() / static_cast<double>(evaluation.fixes);
  result.metrics.push_back({"check_offset_mm", kMillimetersPerMeter * offset_m});
  if (const auto& height_m = evaluation.height_m) {
    result.metrics.push_back({"check_height_mm", kMillimetersPerMeter * height_m->magnitudes.rms});
  }
}

}  // namespace

void add_nominal_differences(const Camera& type, LensResult& result) {
  constexpr double percent = 100;
  const auto& found = result.lens.solution.problem.intrinsics;
  const auto& nominal = type.intrinsics;
  const double focal =
      std::max(std::abs(found[0] / nominal[0] - 1), std::abs(found[1] / nominal[1] - 1));
  result.metrics.push_back({"focal_percent", percent * focal});
  result.metrics.push_back(
      {"principal_point_px", std::hypot(found[2] - nominal[2], found[3] - nominal[3])});
  const auto difference =
      compare_projections(result.lens.solution.fitted_lens(), Lens(type.lens_model, nominal),
                          type.imager_px, [](const Eigen::Vector2d&) { return 1.0; });
  if (difference) result.metrics.push_back({"nominal_difference_px", difference->worst_px});
  const auto& report = result.calibration.intrinsics_report;
  const auto [x_m, y_m] =
      report ? report->board_warp_m.value_or(std::array{0.0, 0.0}) : std::array{0.0, 0.0};
  const double warp_m = std::max({std::abs(x_m), std::abs(y_m), std::abs(x_m + y_m)});
  result.metrics.push_back({"board_warp_mm", kMillimetersPerMeter * warp_m});
}

KnownPointFixes locate_known_points(const StationConfig& config, const Calibration& calibration,
                                    const std::vector<Frame>& frames, const CapturesTable& places) {
  std::vector<TruthRow> truth = list_truth_positions(places);
  KnownPointFixes known{frames, {}, {}};
  std::erase_if(known.frames, [&](const Frame& frame) {
    return std::ranges::find(truth, frame.image, &TruthRow::image) == truth.end();
  });
  if (known.frames.empty()) return known;
  known.located = locate_from_detections({known.frames, config.lamps, calibration, places});
  known.input.fixes = {"check", known.located.rows};
  known.input.truth = {"check", std::move(truth)};
  known.input.reference_point_radius_m = compute_same_position_radius_m(calibration);
  return known;
}

StepResult run_check_step(const StationConfig& config, const Calibration& calibration,
                          const std::vector<Frame>& frames, const CapturesTable& places) {
  const auto [known, located, input] = locate_known_points(config, calibration, frames, places);
  StepResult result =
      check_known_positions(known.size(), frames.size(), config.completion.check_captures);
  if (!result.has_succeeded()) return result;
  result.calibration = calibration;
  add_check_fractions(located, known, config.lamps, result);
  result.rejected_lamps = located.rejected_lamps;
  result.warnings = located.warnings;
  result.notes = located.notes;
  if (!located.has_succeeded()) return result;
  const EvaluateResult errors = evaluate_with_truth(input, {});
  result.drawing = [input = input, lamps = config.lamps] { return draw_floor_plan(input, lamps); };
  add_error_metrics(input, errors.evaluation, result);
  if (const auto& typical = located.summary.statistics; typical && typical->median_residual_px) {
    result.metrics.push_back({"check_residual_px", *typical->median_residual_px});
  }
  return result;
}

}  // namespace vlp
