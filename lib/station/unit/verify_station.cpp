// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/verify_station.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <iterator>

#include "frontend/image_file.h"
#include "rig/input_error.h"
#include "session/check_outliers.h"
#include "session/lamp_causes.h"
#include "session/row_time_step.h"
#include "session/session_folder.h"
#include "station/unit/unit.h"
#include "station/unit/unit_metrics.h"
#include "station/unit/unit_verdict.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Returns the configuration with the golden unit as the type of camera, and with its gates.
StationConfig make_golden_config(StationConfig config) {
  config.nominal_camera = config.golden_unit->calibration.camera;
  config.type_file = "the calibration of the golden unit";
  config.gates = config.golden_unit->gates;
  return config;
}

/// Returns the failed steps and gates. The station is under test, and fails by its metrics.
std::vector<Cause> list_failures(const Unit& unit, const std::vector<CheckedMetric>& metrics) {
  std::vector<Cause> causes;
  for (const StationStep step : kStationSteps) {
    const auto& result = unit.step_state(step).result;
    if (!result || result->has_succeeded()) continue;
    const bool is_station_fault =
        result->failure == StepFailure::wrong_board || result->failure == StepFailure::wrong_map;
    causes.push_back(
        {fmt::format("{}: {}", station_step_name(step), result->message), is_station_fault});
  }
  for (const CheckedMetric& metric : metrics) {
    if (!metric.has_passed_gate())
      causes.push_back({describe_failed_gate(metric), metric.value.has_value()});
  }
  return causes;
}

/// Returns the causes that precede the failed steps and gates.
std::vector<Cause> list_station_causes(const Unit& unit, const Calibration& calibration,
                                       bool has_failed) {
  const StationConfig& config = unit.station_config();
  std::string row_time_error = unit.row_time_check().error;
  if (row_time_error.empty() && has_failed) {
    const Camera& camera = calibration.camera;
    row_time_error =
        search_row_time(list_lamp_observations(unit), config.lamps,
                        Lens(camera.lens_model, camera.intrinsics), make_given_row_time(config))
            .error;
  }
  const std::vector<StepCaptures> steps = list_lamp_captures(unit);
  std::vector<Frame> frames;
  for (const StepCaptures& step : steps)
    frames.insert(frames.end(), step.frames.begin(), step.frames.end());
  std::vector<Cause> causes;
  if (!row_time_error.empty()) causes.push_back({row_time_error, false});
  for (const std::string& fault : list_map_contradictions(frames, config.lamps, calibration))
    causes.push_back({fault, true});
  if (!causes.empty()) return causes;
  // Independent of the gates for lamps: this camera is known.
  const CauseOptions options{.camera_is_known = true, .min_lamp_offset_px = 0.6};
  const auto ranked = rank_lamp_causes(steps, config.lamps, calibration, options);
  if (!is_contradiction_explained(ranked)) {
    const StepCaptures& check = steps.back();
    std::string outliers = describe_wrong_positions(
        locate_known_points(config, calibration, check.frames, check.positions).input);
    if (!outliers.empty()) causes.push_back({std::move(outliers), false});
  }
  for (const LampCause& cause : ranked) {
    const bool is_station_fault =
        cause.kind != LampCauseKind::other_camera && cause.kind != LampCauseKind::other_lens;
    if (has_failed || cause.kind == LampCauseKind::moved_lamp)
      causes.push_back({cause.text, is_station_fault});
  }
  // If all gates pass, they decide whether all lamps must be detected.
  if (!has_failed) return causes;
  for (const std::string& fault : list_missing_lamps(frames, config.lamps))
    causes.push_back({fault, true});
  return causes;
}

}  // namespace

VerificationResult verify_from_images(const StationConfig& config, const fs::path& folder,
                                      const std::string& run, const ProgramVersion& program,
                                      int threads) {
  const StationConfig golden_config = make_golden_config(config);
  const auto& [camera_id, calibration, gates] = *config.golden_unit;
  Unit unit(golden_config, camera_id, program, threads, calibration);
  for (const StationStep step :
       {StationStep::boards, StationStep::dispersion, StationStep::check}) {
    const fs::path images = folder / station_step_name(step);
    if (step == StationStep::check || fs::is_directory(images))
      unit.add_step_images(step, list_images(images));
  }
  unit.solve_completed(true);
  RunRecord record = make_run_record("golden", golden_config, camera_id, run, program);
  record.metrics = unit.collect_metrics();
  record.images = list_run_images(unit);
  std::vector<Cause> failures = list_failures(unit, record.metrics);
  std::vector<Cause> causes = list_station_causes(unit, calibration, !failures.empty());
  std::ranges::move(failures, std::back_inserter(causes));
  record.set_causes(std::move(causes));
  return {std::move(record), unit.collect_plots()};
}

void invalidate_if_reused(
    RunRecord& record,
    const std::function<std::optional<std::string>(const std::string& sha256)>& find_golden_user) {
  for (const RunRecord::Image& image : record.images) {
    if (!image.rejection.empty()) continue;
    const std::optional<std::string> run = find_golden_user(image.sha256);
    if (!run) continue;
    record.invalidate_verdict(fmt::format("image {}/{} was used in golden run {}: measure it again",
                                          image.step, image.name, *run));
    return;
  }
}

}  // namespace vlp
