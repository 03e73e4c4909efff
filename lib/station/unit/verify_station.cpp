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
#include "session/row_time_step.h"
#include "session/session_folder.h"
#include "station/unit/station_faults.h"
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
    row_time_error = describe_other_row_time(list_lamp_observations(unit), config.lamps,
                                             Lens(camera.lens_model, camera.intrinsics),
                                             make_given_row_time(config));
  }
  const UnitStep& check = unit.step_state(StationStep::check);
  const std::vector<Frame> check_frames = list_used_detections(check);
  std::vector<Frame> frames = list_used_detections(unit.step_state(StationStep::dispersion));
  frames.insert(frames.end(), check_frames.begin(), check_frames.end());
  // Independent of the gates: this camera is known.
  constexpr double min_offset_px = 0.6;
  auto faults = list_lamp_map_faults(frames, config.lamps, calibration, min_offset_px);
  if (has_failed) {
    // If all gates pass, they decide whether all lamps must be detected.
    std::ranges::move(list_missing_lamps(frames, config.lamps), std::back_inserter(faults));
  }
  std::vector<Cause> causes;
  if (!row_time_error.empty()) causes.push_back({row_time_error, false});
  for (const std::string& fault : faults) causes.push_back({fault, true});
  if (!faults.empty()) return causes;
  const EvaluationInput input =
      locate_known_points(config, calibration, check_frames, read_captures_with_truth(check.folder))
          .input;
  const auto offset = find_common_offset(input);
  if (offset && has_failed) {
    causes.push_back({describe_common_offset(*offset), true});
  } else if (std::string fault = describe_wrong_positions(input); !fault.empty()) {
    causes.push_back({std::move(fault), false});
  }
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
