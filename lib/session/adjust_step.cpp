// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/adjust_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/rotation_fit.h"
#include "geometry/angles.h"
#include "positioning/known_motion.h"
#include "rig/calibration_builder.h"
#include "rig/calibration_error.h"
#include "rig/find_lamp.h"
#include "rig/input_error.h"
#include "session/lamp_captures.h"
#include "session/rotation_step.h"

namespace vlp {
namespace {

/// Returns the pivot of each image of a rotation in place: one pivot per height.
std::map<std::string, std::string> collect_pivots(const AdjustSet& set,
                                                  const AdjustStepInput& input,
                                                  AdjustStepResult& result) {
  const RotationCaptures turn = detect_pivots(set.frames, input.lamps, input.calibration.camera);
  std::map<std::string, std::string> pivots;
  if (turn.status != RotationStatus::ok) {
    result.warnings.push_back(fmt::format("{} is not treated as a rotation in place: {}", set.name,
                                          describe_status(turn.status)));
    return pivots;
  }
  for (const RotationCapture& capture : turn.captures) {
    pivots[capture.image] = fmt::format("height {}", capture.height + 1);
  }
  return pivots;
}

std::optional<KnownPosition> make_known_place(const Capture& capture, const AdjustSet& set,
                                              const AdjustStepInput& input, int& without_sd) {
  if (!capture.x_m || !capture.y_m) return std::nullopt;
  const auto sd_m = capture.position_sd_m ? capture.position_sd_m : input.position_sd_m;
  if (!sd_m) {
    ++without_sd;
    return std::nullopt;
  }
  if (!(*sd_m > 0)) {
    throw InputError(set.name, "position_sd_m is 0; state the standard deviation of the position");
  }
  return KnownPosition{capture.measured_point, {*capture.x_m, *capture.y_m}, capture.z_m, *sd_m};
}

AdjustmentInput make_adjustment_input(const AdjustStepInput& input, AdjustStepResult& result) {
  if (input.calibration.adjustment) {
    throw InputError(input.calibration_file,
                     "is adjusted already, and its captures would count twice; give the "
                     "calibration from before");
  }
  AdjustmentInput all{{}, input.lamps, input.calibration};
  if (input.lens_sd_px) {
    auto& report = all.calibration.intrinsics_report;
    if (report && report->covariance) {
      throw InputError(input.calibration_file,
                       "has a lens covariance already; leave --lens-sd-px out");
    }
    if (!report) report.emplace();
    report->covariance = make_intrinsics_covariance(all.calibration.camera, *input.lens_sd_px);
  }
  for (Lamp& lamp : all.lamps.lamps) {
    if (!lamp.sd_m) lamp.sd_m = input.map_sd_m;
    if (!lamp.sd_m) {
      throw InputError(
          input.lamps_file,
          fmt::format("lamp {} has no sd_m, the standard deviation of the survey; state it in the "
                      "map, for all lamps or for one, or give --map-sd-m",
                      lamp.id));
    }
  }
  for (const AdjustSet& set : input.sets) {
    const auto turned = set.is_in_place_rotation ? collect_pivots(set, input, result)
                                                 : std::map<std::string, std::string>();
    int without_sd = 0;
    for (const Frame& frame : set.frames) {
      const auto entry = set.captures.find(frame.image);
      const Capture capture_entry = entry == set.captures.end() ? Capture{} : entry->second;
      AdjustmentCapture capture{set.name + "/" + frame.image, frame.detections,
                                capture_entry.inclination};
      if (!capture_entry.pivot.empty()) {
        capture.pivot = set.name + "/" + capture_entry.pivot;
      } else if (const auto spot = turned.find(frame.image); spot != turned.end()) {
        capture.pivot = set.name + "/" + spot->second;
      }
      capture.known_position = make_known_place(capture_entry, set, input, without_sd);
      capture.motion = find_motion(capture_entry, input.motion, input.yaw_rate_sd_rad_per_s)
                           .value_or(KnownMotion());
      if (may_move(capture.motion)) check_timing_known(input.calibration.camera);
      all.captures.push_back(std::move(capture));
    }
    if (without_sd > 0) {
      result.warnings.push_back(
          fmt::format("{}: the positions of {} captures are ignored, as they have no "
                      "position_sd_m; state it, or give --position-sd-m",
                      set.name, without_sd));
    }
  }
  return all;
}

void add_warnings(AdjustStepResult& result, const MapErrors& map_errors) {
  const AdjustmentResult& found = result.adjustment;
  for (const auto& lamp : found.lamps) {
    if (!lamp.is_moved) continue;
    // The adjustment uses more data than the check of the map: heights, places, motion.
    for (const MapError& error : map_errors.errors) {
      if (error.lamps == std::vector<int>{lamp.id})
        std::erase(result.warnings, describe_map_error(error));
    }
    result.warnings.push_back(
        describe_map_error({MapErrorKind::moved, {lamp.id}, lamp.correction_m, lamp.sd_m}));
  }
  for (const auto& place : found.known_positions) {
    if (!place.is_outlier) continue;
    result.warnings.push_back(fmt::format(
        "{}: the position has an error of {:.1f} mm and is ignored{}", place.name,
        1e3 * place.residual_m.norm(),
        place.measured_point == MeasuredPoint::camera
            ? ": is it that of the camera, and not of the rotation axis (reference_point: axis)?"
            : ""));
  }
  if (found.lens_is_contradicted) {
    result.warnings.push_back(
        fmt::format("the captures contradict the lens: its correction has a chi-squared of {:.0f}, "
                    "{} is expected; is it the lens of this camera, with the same focus?",
                    found.lens_chi_squared, found.lens_degrees_of_freedom));
  }
  if (found.noise_is_contradicted) {
    // [ROTATION-1]
    result.warnings.push_back(
        fmt::format("the residuals are {:.2f} times those expected from sigma_px; standard "
                    "deviations follow the residuals",
                    found.noise_scale));
  }
  for (const std::string& note : found.notes) result.notes.push_back(note);
}

}  // namespace

void make_set_names_unique(std::vector<AdjustSet>& sets, const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  names.reserve(sets.size());
  for (const AdjustSet& set : sets) names.push_back(set.name);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (std::count(paths.begin(), paths.end(), paths[i]) > 1) {
      throw std::invalid_argument(paths[i] +
                                  " is named twice: its captures would count twice; give it once");
    }
    if (std::count(names.begin(), names.end(), names[i]) > 1) sets[i].name = paths[i];
  }
}

AdjustStepResult run_adjust_step(const AdjustStepInput& input, HistoryEntry entry) {
  AdjustStepResult result;
  const Calibration alone = extract_camera(input.calibration);
  const AdjustmentInput all = make_adjustment_input(input, result);
  // The check of the map assumes level captures: it skips inclined ones.
  LampCaptures captures{{}, all.lamps, input.lamps_file, input.calibration};
  for (const AdjustmentCapture& capture : all.captures) {
    if (capture.inclination) continue;
    captures.frames.push_back({capture.name, capture.detections});
    captures.motions.push_back(capture.motion);
  }
  const MapErrors map_errors = check_lamp_map(captures, alone, result);
  if (!result.has_succeeded()) return result;
  result.adjustment = adjust_bundle(all);
  const AdjustmentResult& found = result.adjustment;
  if (!found.has_succeeded()) {
    result.set_step_failure(StepFailure::undetermined, found.undetermined);
    explain_by_map_errors(captures, alone, result);
    return result;
  }
  add_warnings(result, map_errors);
  result.metrics = {{"tilt_deg", deg_from_rad(compute_tilt(found.center).angle_rad)}};
  if (const auto& arm_m = found.center.lever_arm_m) {
    result.metrics.push_back({"lever_arm_mm", 1e3 * arm_m->norm()});
  }
  Adjustment adjustment{{}, found.captures, found.detections, found.residual_px};
  for (const AdjustSet& set : input.sets) adjustment.sets.push_back(set.name);
  const LampMap& map = input.refine_map ? found.refined_map : input.lamps;
  std::vector<JointCovariance::LampPosition> lamps;
  for (const int id : found.covariance_lamp_ids)
    lamps.push_back({id, find_lamp_by_id(map.lamps, id)->position_m});
  Calibration calibration = all.calibration;
  calibration.camera = found.camera;
  auto& report = calibration.intrinsics_report;
  const Eigen::MatrixXd& covariance =
      input.refine_map ? found.refined_covariance : found.surveyed_covariance;
  const Eigen::Index n = count_intrinsics(found.camera),
                     rows = covariance.rows() - (report && report->covariance ? 0 : n);
  if (report && report->covariance) report->covariance = covariance.topLeftCorner(n, n);
  JointCovariance joint =
      make_covariance(found.camera, std::move(lamps), covariance.bottomRightCorner(rows, rows));
  result.calibration = add_adjustment(std::move(calibration), found.center, std::move(adjustment),
                                      std::move(joint), std::move(entry));
  return result;
}

}  // namespace vlp
