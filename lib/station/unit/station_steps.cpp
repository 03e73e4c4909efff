// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/station_steps.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "calibration/intrinsics/projection_difference.h"
#include "report/evaluation_pictures.h"
#include "session/dispersion_step.h"
#include "session/evaluate_step.h"
#include "session/lens_step.h"
#include "session/locate_step.h"
#include "session/rotation_step.h"
#include "station/unit/station_faults.h"

namespace vlp {
namespace {

constexpr double kMillimetersPerMeter = 1e3;

/// Prepends the failed part to the reason.
StepResult add_step_name(const char* what, StepResult result) {
  if (!result.has_succeeded()) result.message = fmt::format("{}: {}", what, result.message);
  return result;
}

/// Adds metrics of the difference between the lens and the nominal one.
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

LampCaptures make_lamp_captures(const StationConfig& config, const Calibration& calibration,
                                const std::vector<Frame>& frames) {
  return {frames, config.lamps, "lamp map", calibration};
}

/// Returns the reason if too few captures have known positions; empty if at least `wanted`, or all,
/// have one.
std::string describe_positions_problem(std::size_t known, std::size_t captures, int wanted) {
  if (known > 0 && known >= std::min(captures, static_cast<std::size_t>(wanted))) return "";
  return fmt::format(
      "{} of the {} captures have no position: add x_m and y_m to captures.csv or truth.csv of the "
      "step",
      captures - known, captures);
}

/// Fails a solved step if some captures do not fit the result. They are rejected as outliers, but
/// can be those of another camera. The operator has to repeat them.
StepResult check_consistency(const StationConfig& config, const std::vector<Frame>& frames,
                             StepResult result) {
  if (!result.has_succeeded()) return result;
  std::string fault = explain_large_residuals(frames, config.lamps, result.calibration);
  if (!fault.empty()) result.set_step_failure(StepFailure::undetermined, std::move(fault));
  return result;
}

/// Captures at known points, and the points.
struct KnownPoints {
  std::vector<Frame> frames;
  std::vector<TruthRow> truth;
};

KnownPoints select_known_points(const std::vector<Frame>& frames, const CapturesTable& places) {
  KnownPoints known;
  for (const Frame& frame : frames) {
    const auto entry = places.find(frame.image);
    if (entry == places.end() || !entry->second.x_m || !entry->second.y_m) continue;
    const Capture& place = entry->second;
    if (place.measured_point == MeasuredPoint::axis) continue;
    known.frames.push_back(frame);
    known.truth.push_back({frame.image, {*place.x_m, *place.y_m}, place.z_m, place.yaw_rad});
  }
  return known;
}

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

StepResult run_station_lens(const StationConfig& config, const std::string& camera_id,
                            Observations seen) {
  LensInput input{std::move(seen), config.board, {}, config.nominal_camera};
  input.camera.id = camera_id;
  LensResult result = run_lens_step(std::move(input), {});
  result.skipped.clear();  // the station reports images itself
  if (result.failure == StepFailure::wrong_board)
    return add_step_name("wrong board", std::move(result));
  if (result.has_succeeded()) add_nominal_differences(config.nominal_camera, result);
  // A lens from images of two cameras fits neither of them. The operator has to remove the wrong
  // images.
  if (result.has_succeeded() && !result.lens.inconsistent_views.empty()) {
    result.set_step_failure(StepFailure::undetermined, result.lens.inconsistent_views);
  }
  return result;
}

StepResult run_station_rotation(const StationConfig& config, const Calibration& calibration,
                                const std::vector<Frame>& frames) {
  return add_step_name(
      "the rotation in place",
      check_consistency(config, frames,
                        run_rotation_step(make_lamp_captures(config, calibration, frames),
                                          RotationMethod::axis, {})));
}

StepResult run_station_dispersion(const StationConfig& config, const Calibration& calibration,
                                  const std::vector<Frame>& frames, const CapturesTable& places) {
  const KnownPositions known = collect_known_captures(frames, places, config.dispersion_position_m);
  std::string problem = describe_positions_problem(known.captures.size(), frames.size(),
                                                   config.completion.dispersion_captures);
  if (!problem.empty()) {
    StepResult result;
    result.set_step_failure(StepFailure::wrong_place, std::move(problem));
    return result;
  }
  return add_step_name(
      "the fixes at the station",
      check_consistency(config, frames,
                        run_dispersion_step(make_lamp_captures(config, calibration, frames), known,
                                            DispersionMethod::camera, DispersionCircle::mean, {})));
}

StepResult run_station_check(const StationConfig& config, const Calibration& calibration,
                             const std::vector<Frame>& frames, const CapturesTable& places) {
  StepResult result;
  KnownPoints known = select_known_points(frames, places);
  std::string problem = describe_positions_problem(known.frames.size(), frames.size(),
                                                   config.completion.check_captures);
  if (!problem.empty()) {
    result.set_step_failure(StepFailure::wrong_place, std::move(problem));
    return result;
  }
  result.calibration = calibration;
  const LocateResult located =
      locate_from_detections({known.frames, config.lamps, calibration, places});
  add_check_fractions(located, known.frames, config.lamps, result);
  result.rejected_lamps = located.rejected_lamps;
  result.warnings = located.warnings;
  result.notes = located.notes;
  if (!located.has_succeeded()) return result;
  EvaluationInput input;
  input.fixes = {"check", located.rows};
  input.truth = {"check", std::move(known.truth)};
  input.reference_point_radius_m = compute_same_position_radius_m(calibration);
  const EvaluateResult errors = evaluate_with_truth(input, {});
  result.drawing = [input, lamps = config.lamps] { return draw_floor_plan(input, lamps); };
  add_error_metrics(input, errors.evaluation, result);
  if (const auto& typical = located.summary.statistics; typical && typical->median_residual_px) {
    result.metrics.push_back({"check_residual_px", *typical->median_residual_px});
  }
  return result;
}

}  // namespace vlp
