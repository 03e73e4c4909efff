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
#include "geometry/angles.h"
#include "geometry/median.h"
#include "geometry/polygon.h"
#include "positioning/correction.h"
#include "positioning/known_motion.h"
#include "positioning/lamps_below.h"
#include "positioning/residual_noise.h"
#include "positioning/row_clock.h"
#include "rig/find_lamp.h"
#include "rig/yaml_text.h"
#include "session/lamp_captures.h"
#include "session/row_time_step.h"

namespace vlp {

Sensors make_capture_sensor_readings(const std::string& image, const LocateInput& input) {
  Sensors sensors;
  sensors.motion = input.motion;
  sensors.inclination_sigma_rad = input.roll_pitch_sd_rad;
  const auto entry = input.captures.find(image);
  if (entry == input.captures.end()) return sensors;
  const Capture& capture = entry->second;
  sensors.motion = find_capture_motion(capture, input.motion, input.yaw_rate_sd_rad_per_s);
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

std::size_t count_detections_outside_image(std::span<const Frame> frames,
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

/// Longest time between the frames of a joint fix.
constexpr double kMaxJointInterval_s = 0.2;

class EarlierFrames {
 public:
  explicit EarlierFrames(const LocateInput& input) : input_(input) {
    if (input.window_size < 2) return;
    for (std::size_t i = 0; i < input.frames.size(); ++i) {
      const auto entry = input.captures.find(input.frames[i].image);
      if (entry == input.captures.end() || !entry->second.time_s) continue;
      by_time_.emplace(*entry->second.time_s, i);
    }
  }
  std::vector<EarlierFrame> list_earlier_frames(const std::optional<double>& time_s) const {
    std::vector<EarlierFrame> earlier;
    if (!time_s) return earlier;
    auto at = by_time_.lower_bound(*time_s);
    while (at != by_time_.begin() &&
           earlier.size() + 1 < static_cast<std::size_t>(input_.window_size)) {
      --at;
      const double before_s = *time_s - at->first;
      constexpr double tolerance_s = 1e-6;
      if (before_s > kMaxJointInterval_s + tolerance_s) break;
      if (!earlier.empty() && before_s == earlier.back().before_s) continue;
      earlier.push_back({input_.frames[at->second].detections, before_s});
    }
    return earlier;
  }

 private:
  const LocateInput& input_;
  std::multimap<double, std::size_t> by_time_;
};

/// Estimates a joint fix with the earlier frames. If that fails, as after a change of velocity,
/// estimates the fix of the frame alone.
Fix locate_frame(const Frame& frame, const Positioner& positioner, const EarlierFrames& frames,
                 const Sensors& sensors) {
  const auto earlier = frames.list_earlier_frames(sensors.time_s);
  if (!earlier.empty() && sensors.motion) {
    const Fix joint_fix = positioner.compute_position_fix(frame.detections, sensors, earlier);
    if (joint_fix.has_succeeded()) return joint_fix;
  }
  return positioner.compute_position_fix(frame.detections, sensors);
}

std::vector<Fix> locate_all_frames(const LocateInput& input,
                                   const PositionerOptions& positioner_options) {
  const Positioner positioner(input.lamps, input.calibration, positioner_options);
  const EarlierFrames frames(input);
  std::vector<Fix> fixes;
  fixes.reserve(input.frames.size());
  for (const Frame& frame : input.frames) {
    fixes.push_back(
        locate_frame(frame, positioner, frames, make_capture_sensor_readings(frame.image, input)));
  }
  return fixes;
}

void check_motion(const LocateInput& input) {
  const bool motion =
      input.motion ||
      std::any_of(input.frames.begin(), input.frames.end(), [&](const Frame& frame) {
        const auto known = make_capture_sensor_readings(frame.image, input).motion;
        return known && may_camera_move_during_readout(*known);
      });
  if (motion) check_row_time_and_readout_known(input.calibration.camera);
}

/// Returns the input with LocateInput::sigma_px in all detections.
LocateInput apply_given_pixel_noise(LocateInput input) {
  for (Frame& frame : input.frames) {
    for (Detection& detection : frame.detections) detection.sigma_px = input.sigma_px;
  }
  input.sigma_px.reset();
  return input;
}

bool has_pixel_noise(const Frame& frame) {
  return std::all_of(frame.detections.begin(), frame.detections.end(),
                     [](const Detection& detection) { return detection.sigma_px.has_value(); });
}

/// Returns the ids of the rejected lamps, as many as a fix lists.
std::span<const int> list_rejected(const Fix& fix) {
  const auto count = static_cast<std::size_t>(fix.rejected_lamps);
  return std::span(fix.rejected_ids).first(std::min(fix.rejected_ids.size(), count));
}

FixRow make_fix_row(const Frame& frame, const CapturesTable& captures, const Fix& fix,
                    bool noise_known) {
  FixRow row{frame.image, std::string(fix_status_name(fix.status)), {}, fix.lamps};
  if (const auto entry = captures.find(frame.image); entry != captures.end()) {
    row.time_s = entry->second.time_s;
  }
  if (!fix.has_succeeded()) return row;
  row.fix = {fix.estimate.pose, {}, fix.residual_px};
  if (const auto& body = fix.body) {
    const auto is_uncertain = [&](int index) { return body->covariance(index, index) > 0; };
    if (is_uncertain(kBodyVelocity) || !body->velocity_m_per_s.isZero(0))
      row.fix->velocity_m_per_s = body->velocity_m_per_s;
    if (is_uncertain(kBodyRoll)) row.fix->inclination = body->inclination;
  }
  if (noise_known) {
    row.fix->sd = fix.estimate.covariance.diagonal().cwiseSqrt();
    if (fix.estimate.covariance != fix.noise_covariance) {
      row.fix->noise_sd = fix.noise_covariance.diagonal().cwiseSqrt();
    }
  }
  const auto rejected = list_rejected(fix);
  row.rejected_lamps.assign(rejected.begin(), rejected.end());
  return row;
}

/// Returns the pose of a fix whose roll and pitch are estimated; std::nullopt for other fixes.
std::optional<PoseRow> find_pose_row(const std::string& image, const Fix& fix, bool noise_known,
                                     bool is_camera_turned_over) {
  if (!fix.has_succeeded() || !fix.body || !(fix.body->covariance(kBodyRoll, kBodyRoll) > 0))
    return std::nullopt;
  const auto& [position_m, yaw_rad] = fix.estimate.pose;
  const Eigen::Matrix3d world_from_level = rotation_about_z(yaw_rad);
  const Eigen::Matrix3d level_from_body = level_rotation_from_inclination(fix.body->inclination);
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
  row.covariance = d_pose_d_body * fix.body->covariance * d_pose_d_body.transpose();
  return row;
}

/// Warns if the residuals are much larger than the given noise, and returns true. `factor` scales
/// the standard deviations.
bool warn_about_noise(LocateResult& result, const std::vector<Frame>& frames, double factor) {
  double stated_px = 0;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      stated_px = std::max(stated_px, detection.sigma_px.value_or(0));
    }
  }
  constexpr double max_noise_ratio = 3;
  const auto estimated_px = estimate_pixel_noise_px(sum_squared_residuals_of_fixes(result.fixes));
  if (estimated_px && stated_px > 0) {
    result.metrics.push_back({"residual_ratio", *estimated_px / stated_px});
  }
  if (!estimated_px || *estimated_px <= max_noise_ratio * stated_px) return false;
  // [FIX-11] `sd follows`, `sd is too small` | residuals above the stated noise; several times
  //   larger: error of calibration or map | check both
  result.warnings.push_back(fmt::format(
      "the residuals correspond to {:.2g} px of noise, {:.2g} px are stated: {}; are calibration "
      "and lamp map right and complete?",
      *estimated_px, stated_px, factor > 1 ? "sd follows the residuals" : "sd is too small"));
  return true;
}

/// Returns true if no motion of the camera is given.
bool is_assumed_standing(const LocateInput& input) {
  return std::none_of(input.frames.begin(), input.frames.end(), [&](const Frame& frame) {
    return make_capture_sensor_readings(frame.image, input).motion.has_value();
  });
}

std::size_t count_fixes(const std::vector<Fix>& fixes) {
  return static_cast<std::size_t>(std::count_if(
      fixes.begin(), fixes.end(), [](const Fix& fix) { return fix.has_succeeded(); }));
}

/// Returns the median speed of fixes whose velocity is estimated, if that is significant.
std::optional<double> find_speed_m_per_s(const std::vector<Fix>& fixes) {
  std::vector<double> speeds, sigmas;
  for (const Fix& fix : fixes) {
    if (!fix.has_succeeded() || !fix.body) continue;
    const Eigen::Vector2d& velocity = fix.body->velocity_m_per_s;
    const double variance =
        fix.body->covariance.block<2, 2>(kBodyVelocity, kBodyVelocity).trace() / 2;
    speeds.push_back(velocity.norm());
    sigmas.push_back(velocity.norm() / std::sqrt(variance));
  }
  constexpr double min_sigmas = 3;
  if (speeds.empty() || upper_median(sigmas) < min_sigmas) return std::nullopt;
  return upper_median(speeds);
}

/// Warns if motion explains failed frames or residuals of a camera that is assumed to stand.
/// Criterion: half as many failures, or half the residual.
void warn_about_motion(LocateResult& result, const LocateInput& input, bool is_noisy) {
  const std::size_t failed = input.frames.size() - count_fixes(result.fixes);
  if (!make_readout_clock(input.calibration.camera) || !is_assumed_standing(input) ||
      (!is_noisy && 2 * failed < input.frames.size())) {
    return;
  }
  constexpr double max_speed_m_per_s = 3, max_yaw_rate_rad_per_s = 2;
  LocateInput moving = input;
  moving.motion =
      KnownMotion::make_motion_prior_from_limits(max_speed_m_per_s, max_yaw_rate_rad_per_s);
  const std::vector<Fix> fixes = locate_all_frames(moving, input.positioner_options);
  const auto standing_px = estimate_pixel_noise_px(sum_squared_residuals_of_fixes(result.fixes));
  const auto moving_px = estimate_pixel_noise_px(sum_squared_residuals_of_fixes(fixes));
  const std::size_t still_failed = input.frames.size() - count_fixes(fixes);
  const bool fits =
      is_noisy ? moving_px && *moving_px < *standing_px / 2 : 2 * still_failed < failed;
  const auto speed_m_per_s = find_speed_m_per_s(fixes);
  // Velocity and yaw rate fit the errors if there are few residuals.
  constexpr double min_degrees_of_freedom = 12;
  if (!fits || !speed_m_per_s || *speed_m_per_s > max_speed_m_per_s ||
      sum_squared_residuals_of_fixes(fixes).degrees_of_freedom < min_degrees_of_freedom) {
    return;
  }
  result.warnings.push_back(
      fmt::format("the images fit a moving camera, at {:.2g} m/s: state velocities in "
                  "captures.csv, or --max-speed-m-per-s",
                  *speed_m_per_s));
}

/// Scales the given noise of all detections and removes the detections that `fixes` reject.
LocateInput scale_stated_noise(LocateInput input, const std::vector<Fix>& fixes, double factor) {
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const auto rejected = list_rejected(fixes[i]);
    std::vector<Detection>& detections = input.frames[i].detections;
    std::erase_if(detections, [&](const Detection& detection) {
      return std::ranges::find(rejected, detection.lamp) != rejected.end();
    });
    for (Detection& detection : detections) {
      if (!detection.sigma_px) continue;
      detection.sigma_px = std::min(*detection.sigma_px * factor, kMaxSigma_px);
    }
  }
  return input;
}

/// Locates frames again, with scaled noise, from the lamps that their fixes use.
void locate_with_scaled_noise(const LocateInput& input, const PositionerOptions& positioner_options,
                              double factor, std::vector<Fix>& fixes) {
  std::vector<Fix> rescaled =
      locate_all_frames(scale_stated_noise(input, fixes, factor), positioner_options);
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i].has_succeeded() || !rescaled[i].has_succeeded()) continue;
    rescaled[i].rejected_lamps = fixes[i].rejected_lamps;
    rescaled[i].rejected_ids = fixes[i].rejected_ids;
    rescaled[i].unknown_lamps = fixes[i].unknown_lamps;
    fixes[i] = rescaled[i];
  }
}

/// Locates all frames. Uses the noise estimated from the residuals if none is given or the given
/// one is too small. Returns true if the noise is known.
bool locate_with_noise(const LocateInput& input, LocateResult& result) {
  // The reported errors of calibration and map contribute to the residuals.
  PositionerOptions positioner_options = input.positioner_options;
  positioner_options.computes_common_chi_squared = true;
  result.fixes = locate_all_frames(input, positioner_options);
  std::vector<Fix> stated, unstated;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    (has_pixel_noise(input.frames[i]) ? stated : unstated).push_back(result.fixes[i]);
  }
  const ResidualSums residuals = sum_squared_residuals_of_fixes(stated);
  const double factor = estimate_birge_ratio(residuals);
  bool is_noisy = false;
  if (unstated.empty()) is_noisy = warn_about_noise(result, input.frames, factor);
  warn_about_motion(result, input, is_noisy);
  constexpr double chance_sds = 3;
  if (!is_noisy && factor > 1 + chance_sds * std::sqrt(0.5 / residuals.degrees_of_freedom)) {
    result.notes.push_back(fmt::format(
        "residuals are {:.2f} times the stated noise: sd follows the residuals", factor));
  }
  positioner_options = input.positioner_options;
  bool is_known = true;
  if (!unstated.empty()) {
    auto unstated_factor = estimate_noise_scale_factor(sum_squared_residuals_of_fixes(unstated));
    // Few frames without given noise may have no redundancy: then the noise in pixels is estimated
    // from all frames.
    if (!unstated_factor)
      unstated_factor = estimate_pixel_noise_px(sum_squared_residuals_of_fixes(result.fixes));
    is_known = unstated_factor.has_value();
    if (is_known) {
      positioner_options.unstated_sigma_px = std::clamp(
          positioner_options.unstated_sigma_px * *unstated_factor, kMinSigma_px, kMaxSigma_px);
      result.notes.push_back(
          fmt::format("sigma_px is not stated: {:.3g} px estimated from the residuals",
                      positioner_options.unstated_sigma_px));
    } else {
      // [FIX-12] `sd columns are empty` | no `sigma_px`, and no image with three lamps | state
      //   `sigma_px`
      result.warnings.emplace_back(
          "sigma_px is neither stated nor determined by residuals: sd columns are empty");
    }
  }
  if (factor > 1 || (is_known && !unstated.empty())) {
    locate_with_scaled_noise(input, positioner_options, factor, result.fixes);
  }
  return is_known;
}

void warn_about_image(LocateResult& result, const LocateInput& input) {
  const auto& [width, height] = input.calibration.camera.imager_px;
  const std::size_t outside = count_detections_outside_image(input.frames, {width, height});
  if (outside == 0) return;
  result.warnings.push_back(
      fmt::format("{} detections are far outside the {} x {} px of the camera: is it the "
                  "calibration of this camera?",
                  outside, width, height));
}

/// Marks the fixes that use lamps outside the calibrated region of the image, where the board was
/// not seen.
void mark_fixes_outside_valid_region(LocateResult& result, const LocateInput& input) {
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
      without, input.frames.size(), quote_text_for_message(input.frames.front().image),
      quote_text_for_message(captures.begin()->first)));
}

/// Finds errors of the lamp map from the captures in which the camera stands.
MapErrors find_errors_while_standing(const LocateInput& input, const std::vector<Fix>& fixes) {
  const bool below = input.lamps.lamps_below_camera;
  std::vector<Frame> frames;
  MapErrorOptions options;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const Sensors sensors = make_capture_sensor_readings(input.frames[i].image, input);
    if (sensors.motion && may_camera_move_during_readout(*sensors.motion)) continue;
    const auto& body = fixes[i].body;
    frames.push_back(input.frames[i]);
    options.inclinations.push_back(body ? std::optional(body->inclination) : sensors.inclination);
    auto& inclination = options.inclinations.back();
    if (inclination) inclination = turn_over_if(below, *inclination);
  }
  if (const auto& mount = input.positioner_options.mount)
    options.yaw_in_robot_rad = turn_over_if(below, *mount).yaw_in_robot_rad;
  if (input.compute_lamp_offsets) options.max_captures = std::max<std::size_t>(frames.size(), 1);
  MapErrors found = detect_misplaced_or_swapped_lamps(frames, turn_over_if(below, input.lamps),
                                                      input.calibration, options);
  if (!below) return found;
  for (MapError& error : found.errors) error.offset_m.tail<2>() *= -1;
  for (LampOffset& offset : found.offsets) {
    offset.map_m.y() *= -1;
    offset.offset_m.y() *= -1;
  }
  return found;
}

void warn_about_rejected_lamps(LocateResult& result, const LocateInput& input,
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
    // [FIX-10] `the others, rejected`, `is rejected in` | lamps misidentified. Displaced lamps are
    //   listed with their offset instead. | check these lamps
    result.warnings.push_back(
        fmt::format("{} detections that contradict the others, rejected", rejected));
  }
  for (const auto& [id, count] : captures) {
    result.warnings.push_back(
        fmt::format("lamp {} is rejected in {} of {} captures", id, count, input.frames.size()));
  }
}

}  // namespace

LocateResult locate_camera_from_detections(const LocateInput& input) {
  if (input.sigma_px) return locate_camera_from_detections(apply_given_pixel_noise(input));
  check_motion(input);
  LocateResult result;
  const bool noise_known = locate_with_noise(input, result);
  const bool turned = input.lamps.lamps_below_camera && !input.positioner_options.mount;
  result.rows.reserve(result.fixes.size());
  for (std::size_t i = 0; i < result.fixes.size(); ++i) {
    result.rows.push_back(
        make_fix_row(input.frames[i], input.captures, result.fixes[i], noise_known));
    if (auto pose = find_pose_row(input.frames[i].image, result.fixes[i], noise_known, turned))
      result.poses.push_back(std::move(*pose));
  }
  warn_about_image(result, input);
  mark_fixes_outside_valid_region(result, input);
  const int elsewhere = Positioner(input.lamps, input.calibration, input.positioner_options)
                            .num_lamps_moved_since_calibration();
  if (elsewhere > 0) result.warnings.push_back(describe_lamps_moved_since_calibration(elsewhere));
  warn_about_captures(result, input);
  const bool is_contradicted =
      std::any_of(result.fixes.begin(), result.fixes.end(),
                  [](const Fix& fix) { return !fix.has_succeeded() || fix.rejected_lamps > 0; });
  MapErrors map_errors;
  if (input.compute_lamp_offsets || is_contradicted)
    map_errors = find_errors_while_standing(input, result.fixes);
  warn_about_rejected_lamps(result, input, map_errors);
  if (input.compute_lamp_offsets) {
    result.lamp_offsets = std::move(map_errors.offsets);
    if (input.frames.size() > 1 && result.lamp_offsets.empty()) {
      // [FIX-13] `not tie all lamps` | note: lamps never visible next to two others; their
      //   displacement is undetectable | captures between them
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

/// A capture whose tilt is estimated.
struct TiltedCapture {
  std::size_t frame;
  std::vector<Detection> first_detections;
  /// Plane of the current detections; std::nullopt: that of the first ones.
  std::optional<std::optional<Eigen::Matrix3d>> level = std::nullopt;
  bool has_converged = false;
};

class TiltedCaptures {
 public:
  TiltedCaptures(LocateInput& input, const Redetector& redetect)
      : input_(input),
        redetect_(redetect),
        base_from_camera_(compute_level_from_camera_matrix(input.calibration,
                                                           input.positioner_options.correction)) {
    for (std::size_t i = 0; i < input.frames.size(); ++i) {
      const Frame& frame = input.frames[i];
      if (make_capture_sensor_readings(frame.image, input).inclination_sigma_rad > 0) {
        captures_.push_back({i, frame.detections});
      }
    }
  }

  LevelRotations iterate_until_tilt_converges() {
    if (captures_.empty()) return {};
    fixes_ = locate_camera_from_detections(input_).fixes;
    initialize_tilt_from_ellipses();
    constexpr int max_iterations = 6;
    for (int i = 0; i < max_iterations && redetect_in_level_planes(); ++i) {
    }
    LevelRotations levels;
    for (const TiltedCapture& capture : captures_) {
      if (capture.level) levels.emplace(image_name(capture), *capture.level);
    }
    return levels;
  }

 private:
  const std::string& image_name(const TiltedCapture& capture) const {
    return input_.frames[capture.frame].image;
  }

  void detect_in_level_planes(const LevelRotations& levels) {
    if (levels.empty()) return;
    std::vector<Frame> seen = redetect_(levels);
    for (const TiltedCapture& capture : captures_) {
      if (levels.find(image_name(capture)) == levels.end()) continue;
      const auto frame = std::find_if(seen.begin(), seen.end(), [&](const Frame& candidate) {
        return candidate.image == image_name(capture);
      });
      if (frame != seen.end()) {
        input_.frames[capture.frame].detections = std::move(frame->detections);
      }
    }
    fixes_ = locate_camera_from_detections(input_).fixes;
  }

  void initialize_tilt_from_ellipses() {
    constexpr double max_small_tilt_rad = 0.05;
    const std::vector<Fix> first = fixes_;
    LevelRotations levels;
    for (TiltedCapture& capture : captures_) {
      const double sd_rad =
          make_capture_sensor_readings(image_name(capture), input_).inclination_sigma_rad;
      if (sd_rad <= max_small_tilt_rad && fixes_[capture.frame].has_succeeded()) continue;
      capture.level.emplace();
      levels.emplace(image_name(capture), std::nullopt);
    }
    detect_in_level_planes(levels);
    for (TiltedCapture& capture : captures_) {
      const Fix& fix = first[capture.frame];
      std::vector<Detection>& seen = input_.frames[capture.frame].detections;
      if (fixes_[capture.frame].has_succeeded()) continue;
      capture.has_converged = !fix.has_succeeded();
      if (!fix.has_succeeded() && seen.size() > capture.first_detections.size()) continue;
      capture.level.reset();
      seen = capture.first_detections;
      fixes_[capture.frame] = fix;
    }
  }

  /// Repeats the detections that have not converged. Returns false if there are none.
  bool redetect_in_level_planes() {
    LevelRotations levels;
    for (TiltedCapture& capture : captures_) {
      const Fix& fix = fixes_[capture.frame];
      capture.has_converged = capture.has_converged || !fix.has_succeeded() || !fix.body;
      if (capture.has_converged) continue;
      const bool below = input_.lamps.lamps_below_camera;
      const CameraMount mount =
          input_.positioner_options.mount.value_or(CameraMount{Eigen::Vector3d::Zero(), 0});
      capture.level = compute_level_rotation_from_inclination(
          turn_over_if(below, fix.body->inclination), turn_over_if(below, mount).yaw_in_robot_rad,
          base_from_camera_);
      levels.emplace(image_name(capture), *capture.level);
    }
    const std::vector<Fix> before = fixes_;
    detect_in_level_planes(levels);
    for (TiltedCapture& capture : captures_) {
      if (capture.has_converged) continue;
      capture.has_converged = has_fix_converged(before[capture.frame], fixes_[capture.frame]);
    }
    return !levels.empty();
  }

  static bool has_fix_converged(const Fix& before, const Fix& after) {
    constexpr double tolerance_sd = 0.1;
    if (!after.has_succeeded()) return true;
    Eigen::Vector4d change;
    change << after.estimate.pose.position_m - before.estimate.pose.position_m,
        wrap_angle_rad(after.estimate.pose.yaw_rad - before.estimate.pose.yaw_rad);
    const Eigen::Vector4d sd = after.noise_covariance.diagonal().cwiseSqrt();
    return (change.cwiseAbs().array() <= tolerance_sd * sd.array()).all();
  }

  LocateInput& input_;
  const Redetector& redetect_;
  Eigen::Matrix3d base_from_camera_;
  std::vector<TiltedCapture> captures_;
  std::vector<Fix> fixes_;
};

/// Applies an intake to the named images again.
Observations detect_in_images_again(const LampIntake& intake,
                                    const std::vector<std::filesystem::path>& files,
                                    const LevelRotations& levels) {
  std::vector<std::filesystem::path> named;
  std::copy_if(files.begin(), files.end(), std::back_inserter(named), [&](const auto& file) {
    return levels.find(file.filename().string()) != levels.end();
  });
  return intake.copy_intake_with_level_rotations(levels).detect_lamps_in_all_images(named);
}

bool has_detections(const std::vector<Frame>& frames) {
  return std::any_of(frames.begin(), frames.end(),
                     [](const Frame& frame) { return !frame.detections.empty(); });
}

}  // namespace

LocateResult locate_camera_from_images(const LampImages& images, ImageUse use, LocateInput input,
                                       const FrontendOptions& options,
                                       const IntakeProgress& progress) {
  const LampIntake intake(images, use, options);
  if (!input.calibration.camera.readout)
    input.calibration.camera.readout = intake.readout_direction();
  const auto files = list_lamp_images(images.images);
  Observations seen = intake.detect_lamps_in_all_images(files, progress);
  check_any_lamp_identified(images, seen);
  input.frames = collect_lamp_frames_of_kept_images(seen.images);
  const LampIntake without_pictures = intake.copy_intake_with_annotation_folder({});
  std::map<std::string, Observation> latest;
  const LevelRotations levels =
      redetect_lamps_until_tilt_converges(input, [&](const LevelRotations& tilted) {
        const Observations repeated = detect_in_images_again(without_pictures, files, tilted);
        for (const Observation& image : repeated.images) {
          if (image.is_image_kept()) latest.insert_or_assign(image.image_file_name(), image);
        }
        return collect_lamp_frames_of_kept_images(repeated.images);
      });
  for (Observation& image : seen.images) {
    const auto repeated = latest.find(image.image_file_name());
    if (levels.contains(image.image_file_name()) && repeated != latest.end())
      image = repeated->second;
  }
  if (!options.annotate.empty()) detect_in_images_again(intake, files, levels);
  LocateResult result;
  if (has_detections(input.frames)) {
    seen.failure.reset();
    result = locate_camera_from_detections(input);
  }
  add_image_intake_remarks(seen, result);
  // A classifier identifies lamps without the row time: it is no reason why there is no result.
  if (options.classifier.empty() || result.has_succeeded()) {
    add_row_time_contradiction_to_result(seen.images, input.lamps,
                                         make_detector_camera(input.calibration),
                                         images.calibration_file.filename().string(), result);
  }
  result.observations = std::move(seen);
  return result;
}

LevelRotations redetect_lamps_until_tilt_converges(LocateInput& input, const Redetector& redetect) {
  return TiltedCaptures(input, redetect).iterate_until_tilt_converges();
}

}  // namespace vlp
