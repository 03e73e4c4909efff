// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/locate_step.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "calibration/map/map_errors.h"
#include "camera/lens.h"
#include "geometry/polygon.h"
#include "positioning/image_fix.h"
#include "positioning/known_motion.h"
#include "positioning/lamps_below.h"
#include "rig/find_lamp.h"
#include "rig/yaml_text.h"
#include "session/lamp_captures.h"
#include "session/locate_frames.h"
#include "session/row_time_step.h"

namespace vlp {

Sensors make_sensor_readings(const std::string& image, const LocateInput& input) {
  Sensors sensors;
  sensors.motion = input.motion;
  sensors.inclination_sigma_rad = input.roll_pitch_sd_rad;
  const auto entry = input.captures.find(image);
  if (entry == input.captures.end()) return sensors;
  const Capture& capture = entry->second;
  sensors.motion = find_motion(capture, input.motion, input.yaw_rate_sd_rad_per_s);
  sensors.time_s = capture.time_s;
  if (capture.inclination) {
    sensors.inclination = capture.inclination;
    sensors.inclination_sigma_rad = input.inclination_sigma_rad;
  }
  if (input.allow_single_lamp && capture.z_m && capture.yaw_rad) {
    sensors.height_and_yaw = HeightAndYaw{*capture.z_m, *capture.yaw_rad,
                                          input.height_sd_m.value_or(0), input.yaw_sd_rad};
  }
  if (input.height_sd_m && capture.z_m) {
    // The height in the table is that of the camera.
    const double above_m = input.positioner_options.mount
                               ? input.positioner_options.mount->position_in_robot_m.z()
                               : 0;
    sensors.height = KnownHeight{*capture.z_m - above_m, *input.height_sd_m};
  }
  return sensors;
}

std::size_t count_outside_image(std::span<const Frame> frames,
                                const std::array<int, 2>& imager_px) {
  constexpr double fraction = 0.1;
  const Eigen::Array2d size(imager_px[0], imager_px[1]);
  std::size_t outside = 0;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      const Eigen::Array2d pixel = detection.pixel.array();
      const bool near = (pixel >= -fraction * size).all() && (pixel <= (1 + fraction) * size).all();
      outside += near ? 0 : 1;
    }
  }
  return outside;
}

namespace {

void check_motion(const LocateInput& input) {
  const bool motion =
      input.motion ||
      std::any_of(input.frames.begin(), input.frames.end(), [&](const Frame& frame) {
        const auto known = make_sensor_readings(frame.image, input).motion;
        return known && may_move(*known);
      });
  if (motion) check_timing_known(input.calibration.camera);
}

/// Returns the input with LocateInput::sigma_px in all detections.
LocateInput apply_given_noise(LocateInput input) {
  for (Frame& frame : input.frames) {
    for (Detection& detection : frame.detections) detection.sigma_px = input.sigma_px;
  }
  input.sigma_px.reset();
  return input;
}

FixRow make_fix_row(const Frame& frame, const CapturesTable& captures, const Fix& fix,
                    bool noise_known) {
  FixRow row{frame.image, std::string(fix_status_name(fix.status)), {}, fix.lamps};
  if (const auto entry = captures.find(frame.image); entry != captures.end()) {
    row.time_s = entry->second.time_s;
  }
  if (!fix.has_succeeded()) return row;
  row.fix = {fix.state.pose, {}, fix.residual_px};
  const BodyMotion& motion = fix.state.motion;
  if (is_state_estimated(fix, kBodyVelocity) || !motion.velocity_m_per_s.isZero(0)) {
    row.fix->velocity_m_per_s =
        Eigen::Rotation2Dd(fix.state.pose.yaw_rad) * motion.velocity_m_per_s;
  }
  if (is_state_estimated(fix, kBodyRoll)) row.fix->inclination = motion.inclination;
  if (noise_known) {
    row.fix->sd = fix.covariance.diagonal().head<4>().cwiseSqrt();
    if (fix.covariance != fix.noise_covariance) {
      row.fix->noise_sd = fix.noise_covariance.diagonal().head<4>().cwiseSqrt();
    }
  }
  const auto rejected = list_rejected(fix);
  row.rejected_lamps.assign(rejected.begin(), rejected.end());
  return row;
}

/// Returns the pose of a fix whose roll and pitch are estimated; std::nullopt for other fixes.
std::optional<PoseRow> find_pose_row(const std::string& image, const Fix& fix, bool noise_known,
                                     bool is_camera_turned_over) {
  if (!fix.has_succeeded() || !is_state_estimated(fix, kBodyRoll)) return std::nullopt;
  const auto& [position_m, yaw_rad] = fix.state.pose;
  const Eigen::Matrix3d world_from_level = rotation_about_z(yaw_rad);
  const Eigen::Matrix3d level_from_body =
      level_rotation_from_inclination(fix.state.motion.inclination);
  Eigen::Matrix3d world_from_camera = world_from_level * level_from_body;
  if (is_camera_turned_over) world_from_camera.rightCols<2>() *= -1;
  PoseRow row{image, position_m, Eigen::Quaterniond(world_from_camera), {}};
  if (!noise_known) return row;
  // Small rotation about the axes of the world, by yaw, pitch and roll.
  Eigen::Matrix<double, 6, kBodyStates> d_pose_d_body =
      Eigen::Matrix<double, 6, kBodyStates>::Identity();
  d_pose_d_body.bottomRows<3>().setZero();
  d_pose_d_body.block<3, 1>(3, kBodyYaw) = Eigen::Vector3d::UnitZ();
  d_pose_d_body.block<3, 1>(3, kBodyPitch) = world_from_level.col(1);
  d_pose_d_body.block<3, 1>(3, kBodyRoll) = world_from_level * level_from_body.col(0);
  row.covariance = d_pose_d_body * fix.covariance * d_pose_d_body.transpose();
  return row;
}

void warn_about_image(LocateResult& result, const LocateInput& input) {
  const auto& [width, height] = input.calibration.camera.imager_px;
  const std::size_t outside = count_outside_image(input.frames, {width, height});
  if (outside == 0) return;
  result.warnings.push_back(
      fmt::format("{} detections are far outside the {} x {} px of the camera: is it the "
                  "calibration of this camera?",
                  outside, width, height));
}

/// Marks the fixes that use lamps outside the calibrated region of the image, where the board was
/// not seen.
void mark_outside(LocateResult& result, const LocateInput& input) {
  const auto& report = input.calibration.intrinsics_report;
  if (!report || report->region_px.empty()) return;
  std::size_t outside = 0, fixes = 0;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    if (!result.fixes[i].has_succeeded()) continue;
    ++fixes;
    const auto& detections = input.frames[i].detections;
    const auto& rejected = result.rows[i].rejected_lamps;
    auto& lamps_outside = result.rows[i].lamps_outside_region;
    for (const Detection& detection : detections) {
      if (polygon_contains(report->region_px, detection.pixel)) continue;
      if (find_lamp_by_id(input.lamps.lamps, detection.lamp) == nullptr) continue;
      if (std::find(rejected.begin(), rejected.end(), detection.lamp) != rejected.end()) continue;
      lamps_outside.push_back(detection.lamp);
    }
    if (lamps_outside.empty()) continue;
    ++outside;
    result.details.push_back(
        fmt::format("{}: {} of {} lamps are outside the valid region of the lens",
                    input.frames[i].image, lamps_outside.size(), detections.size()));
  }
  if (outside == 0) return;
  result.warnings.push_back(
      fmt::format("{} of {} fixes use lamps outside the valid region of the lens (valid_region_px "
                  "of the calibration; outside_region of the fixes lists them), where it may be "
                  "wrong; add views of the board there",
                  outside, fixes));
}

void warn_about_captures(LocateResult& result, const LocateInput& input) {
  const auto& captures = input.captures;
  const auto without = std::count_if(
      input.frames.begin(), input.frames.end(),
      [&](const Frame& frame) { return captures.find(frame.image) == captures.end(); });
  if (captures.empty() || without == 0) return;
  result.warnings.push_back(fmt::format(
      "{} of {} images are not in captures.csv: image names have to be equal ({} in the images, "
      "{} in the table)",
      without, input.frames.size(), quote_for_message(input.frames.front().image),
      quote_for_message(captures.begin()->first)));
}

/// Finds errors of the lamp map from the captures in which the camera stands.
MapErrors detect_standing_errors(const LocateInput& input, const std::vector<Fix>& fixes) {
  const bool below = input.lamps.lamps_below_camera;
  std::vector<Frame> frames;
  MapErrorOptions options;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const Sensors sensors = make_sensor_readings(input.frames[i].image, input);
    if (sensors.motion && may_move(*sensors.motion)) continue;
    frames.push_back(input.frames[i]);
    options.inclinations.push_back(is_state_estimated(fixes[i], kBodyRoll)
                                       ? std::optional(fixes[i].state.motion.inclination)
                                       : sensors.inclination);
    auto& inclination = options.inclinations.back();
    if (inclination) inclination = rotate_upside_down_if(below, *inclination);
  }
  if (const auto& mount = input.positioner_options.mount)
    options.yaw_in_robot_rad = rotate_upside_down_if(below, *mount).yaw_in_robot_rad;
  if (input.compute_lamp_offsets) options.max_captures = std::max<std::size_t>(frames.size(), 1);
  MapErrors found = detect_map_errors(frames, rotate_upside_down_if(below, input.lamps),
                                      input.calibration, options);
  if (!below) return found;
  for (MapError& error : found.errors) error.offset_m.tail<2>() *= -1;
  for (LampOffset& offset : found.offsets) {
    offset.map_m.y() *= -1;
    offset.offset_m.y() *= -1;
  }
  return found;
}

void warn_about_rejected(LocateResult& result, const LocateInput& input,
                         const MapErrors& map_errors) {
  int unknown = 0, rejected = 0;
  std::map<int, int> captures;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    unknown += result.fixes[i].unknown_lamps;
    rejected += result.fixes[i].rejected_lamps;
    for (const int id : result.rows[i].rejected_lamps) {
      ++captures[id];
      result.details.push_back(fmt::format("{}: lamp {} contradicts the others and is rejected",
                                           input.frames[i].image, id));
    }
  }
  for (const auto& [id, count] : captures) result.rejected_lamps.push_back({id, count});
  if (unknown > 0) {
    result.warnings.push_back(
        fmt::format("{} detections of lamps not in the map, rejected", unknown));
  }
  for (const MapError& error : map_errors.errors) {
    result.warnings.push_back(describe_map_error(error));
    for (const int id : error.lamps) {
      rejected -= captures[id];
      captures.erase(id);
    }
  }
  if (rejected > 0) {
    // [FIX-10] `the others, rejected`, `is rejected in` | lamps misidentified | check these lamps
    result.warnings.push_back(
        fmt::format("{} detections that contradict the others, rejected", rejected));
  }
  for (const auto& [id, count] : captures) {
    result.warnings.push_back(
        fmt::format("lamp {} is rejected in {} of {} captures", id, count, input.frames.size()));
  }
}

}  // namespace

LocateResult locate_from_detections(const LocateInput& input) {
  if (input.sigma_px) return locate_from_detections(apply_given_noise(input));
  check_motion(input);
  LocateResult result;
  const bool noise_known = locate_frames(input, result);
  const bool turned = input.lamps.lamps_below_camera && !input.positioner_options.mount;
  result.rows.reserve(result.fixes.size());
  for (std::size_t i = 0; i < result.fixes.size(); ++i) {
    result.rows.push_back(
        make_fix_row(input.frames[i], input.captures, result.fixes[i], noise_known));
    if (auto pose = find_pose_row(input.frames[i].image, result.fixes[i], noise_known, turned))
      result.poses.push_back(std::move(*pose));
  }
  warn_about_image(result, input);
  mark_outside(result, input);
  const int elsewhere = Positioner(input.lamps, input.calibration, input.positioner_options)
                            .num_lamps_moved_since_calibration();
  if (elsewhere > 0) result.warnings.push_back(describe_moved_lamps(elsewhere));
  warn_about_captures(result, input);
  const bool is_contradicted =
      std::any_of(result.fixes.begin(), result.fixes.end(),
                  [](const Fix& fix) { return !fix.has_succeeded() || fix.rejected_lamps > 0; });
  MapErrors map_errors;
  if (input.compute_lamp_offsets || is_contradicted)
    map_errors = detect_standing_errors(input, result.fixes);
  warn_about_rejected(result, input, map_errors);
  if (input.compute_lamp_offsets) {
    result.lamp_offsets = std::move(map_errors.offsets);
    if (input.frames.size() > 1 && result.lamp_offsets.empty()) {
      // [FIX-13] `not tie all lamps` | note: lamps never visible next to two others | captures
      //   between them
      result.notes.push_back(
          "relative lamp positions are not checked: captures do not tie all lamps together");
    }
  }
  result.summary = summarize_fixes(result.rows);
  if (result.summary.fixes == 0) {
    result.set_step_failure(StepFailure::undetermined,
                            fmt::format("no frame has a fix; the first: {}",
                                        describe_fix_status(result.fixes.front().status)));
  }
  return result;
}

namespace {

/// Repeats the detection of lamps in the level plane of the fix if the tilt is estimated.
std::vector<Light> repeat_if_tilted(const LocateInput& input, const Positioner& positioner,
                                    const std::string& image, std::vector<Light> lights,
                                    const LightsInPlane& detect) {
  const Sensors sensors = make_sensor_readings(image, input);
  if (sensors.inclination_sigma_rad == 0) return lights;
  std::vector<std::vector<Light>> repetitions;
  const auto add = [&](std::vector<Light> found) {
    std::vector<Detection> lamps = select_lamps(found);
    for (Detection& lamp : lamps) {
      if (input.sigma_px) lamp.sigma_px = input.sigma_px;
    }
    repetitions.push_back(std::move(found));
    return lamps;
  };
  const ImageFix found = locate_with_repeated_detection(
      positioner, sensors, add(std::move(lights)),
      [&](const auto& level_from_camera) { return add(detect(level_from_camera)); });
  return std::move(repetitions[found.repetition]);
}

bool has_detections(const std::vector<Frame>& frames) {
  return std::any_of(frames.begin(), frames.end(),
                     [](const Frame& frame) { return !frame.detections.empty(); });
}

}  // namespace

LocateResult locate_from_images(const LampImages& images, ImageUse use, LocateInput input,
                                const FrontendOptions& options, const IntakeProgress& progress) {
  LampIntake intake(images, use, options);
  if (!input.calibration.camera.readout)
    input.calibration.camera.readout = intake.readout_direction();
  const Positioner positioner(input.lamps, input.calibration, input.positioner_options);
  intake.set_detection_repetition(
      [&](const std::string& image, std::vector<Light> lights, const LightsInPlane& detect) {
        return repeat_if_tilted(input, positioner, image, std::move(lights), detect);
      });
  Observations seen = intake.detect_lamps_in_images(list_lamp_images(images.images), progress);
  check_any_identified(images, options, seen);
  input.frames = collect_lamp_frames(seen.images);
  LocateResult result;
  if (has_detections(input.frames)) {
    seen.failure.reset();
    result = locate_from_detections(input);
  }
  add_intake_remarks(seen, result);
  // A classifier identifies lamps without the row time: it is no reason why there is no result.
  if (options.classifier.empty() || result.has_succeeded()) {
    add_row_time_remark(seen.images, input.lamps, make_detector_camera(input.calibration),
                        images.calibration_file.filename().string(), result);
  }
  result.observations = std::move(seen);
  return result;
}

}  // namespace vlp
