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
#include "positioning/image_fix.h"
#include "positioning/known_motion.h"
#include "positioning/lamps_below.h"
#include "positioning/residual_noise.h"
#include "positioning/row_clock.h"
#include "rig/find_lamp.h"
#include "rig/yaml_text.h"
#include "session/lamp_captures.h"
#include "session/pixel_noise.h"
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
  std::vector<EarlierFrame> list_earlier(const std::optional<double>& time_s) const {
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
  const auto earlier = frames.list_earlier(sensors.time_s);
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
        locate_frame(frame, positioner, frames, make_sensor_readings(frame.image, input)));
  }
  return fixes;
}

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

bool has_pixel_noise(const Frame& frame) {
  return std::all_of(frame.detections.begin(), frame.detections.end(),
                     [](const Detection& detection) { return detection.sigma_px.has_value(); });
}

/// Returns the ids of the rejected lamps, as many as a fix lists.
std::span<const int> list_rejected(const Fix& fix) {
  const auto count = static_cast<std::size_t>(fix.rejected_lamps);
  return std::span(fix.rejected_ids).first(std::min(fix.rejected_ids.size(), count));
}

bool is_state_estimated(const Fix& fix, int state) { return fix.covariance(state, state) > 0; }

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
  const auto estimated_px = estimate_noise_px(sum_fix_residuals(result.fixes));
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
    return make_sensor_readings(frame.image, input).motion.has_value();
  });
}

/// Returns true if roll and pitch of no camera are given or estimated.
bool is_assumed_level(const LocateInput& input) {
  return std::ranges::none_of(input.frames, [&](const Frame& frame) {
    const Sensors sensors = make_sensor_readings(frame.image, input);
    return sensors.inclination || sensors.inclination_sigma_rad > 0;
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
    if (!fix.has_succeeded() || !is_state_estimated(fix, kBodyVelocity)) continue;
    const Eigen::Vector2d& velocity = fix.state.motion.velocity_m_per_s;
    const double variance = fix.covariance.block<2, 2>(kBodyVelocity, kBodyVelocity).trace() / 2;
    speeds.push_back(velocity.norm());
    sigmas.push_back(velocity.norm() / std::sqrt(variance));
  }
  constexpr double min_sigmas = 3;
  if (speeds.empty() || upper_median(sigmas) < min_sigmas) return std::nullopt;
  return upper_median(speeds);
}

/// Returns the median angle between the camera and the vertical, rad, of fixes whose roll and pitch
/// are estimated, if that is significant.
std::optional<double> find_tilt_rad(const std::vector<Fix>& fixes) {
  std::vector<double> tilts, sigmas;
  for (const Fix& fix : fixes) {
    if (!fix.has_succeeded() || !is_state_estimated(fix, kBodyRoll)) continue;
    const auto& [roll_rad, pitch_rad] = fix.state.motion.inclination;
    tilts.push_back(std::hypot(roll_rad, pitch_rad));
    sigmas.push_back(tilts.back() / std::sqrt(fix.covariance.diagonal().tail<2>().maxCoeff()));
  }
  constexpr double min_sigmas = 3;
  if (tilts.empty() || upper_median(sigmas) < min_sigmas) return std::nullopt;
  return upper_median(tilts);
}

/// A state of the camera that explains failed frames or residuals, with the remaining noise.
struct Explanation {
  double noise_px;
  std::string warning;
};

/// Returns the fixes with other assumptions if they explain failed frames or residuals. Criterion:
/// half as many failures, or half the residual.
std::optional<std::vector<Fix>> find_better_fixes(const LocateResult& result,
                                                  const LocateInput& other,
                                                  const PositionerOptions& options, bool is_noisy) {
  const std::size_t failed = other.frames.size() - count_fixes(result.fixes);
  std::vector<Fix> fixes = locate_all_frames(other, options);
  const ResidualSums residuals = sum_fix_residuals(fixes);
  const auto noise_px = estimate_noise_px(sum_fix_residuals(result.fixes));
  const auto other_px = estimate_noise_px(residuals);
  const bool fits = is_noisy ? other_px && *other_px < *noise_px / 2
                             : 2 * (other.frames.size() - count_fixes(fixes)) < failed;
  // More unknowns fit the errors if there are few residuals.
  constexpr double min_degrees_of_freedom = 12;
  if (!fits || residuals.degrees_of_freedom < min_degrees_of_freedom) return std::nullopt;
  return fixes;
}

std::optional<Explanation> explain_by_motion(const LocateResult& result, const LocateInput& input,
                                             bool is_noisy) {
  if (!make_readout_clock(input.calibration.camera) || !is_assumed_standing(input))
    return std::nullopt;
  constexpr double max_speed_m_per_s = 3, max_yaw_rate_rad_per_s = 2;
  LocateInput moving = input;
  moving.motion =
      KnownMotion::make_motion_prior_from_limits(max_speed_m_per_s, max_yaw_rate_rad_per_s);
  const auto fixes = find_better_fixes(result, moving, input.positioner_options, is_noisy);
  const auto speed_m_per_s = fixes ? find_speed_m_per_s(*fixes) : std::nullopt;
  if (!speed_m_per_s || *speed_m_per_s > max_speed_m_per_s) return std::nullopt;
  return Explanation{
      estimate_noise_px(sum_fix_residuals(*fixes)).value_or(0),
      // [FIX-14] `fit a moving camera` | motion or tilt is not stated | state it, or the option
      fmt::format("the images fit a moving camera, at {:.2g} m/s: state velocities in "
                  "captures.csv, or --max-speed-m-per-s",
                  *speed_m_per_s)};
}

std::optional<Explanation> explain_by_tilt(const LocateResult& result, const LocateInput& input,
                                           bool is_noisy) {
  if (!is_assumed_level(input)) return std::nullopt;
  constexpr double roll_pitch_sd_rad = 0.15;
  LocateInput tilted = input;
  tilted.roll_pitch_sd_rad = roll_pitch_sd_rad;
  const auto fixes = find_better_fixes(result, tilted, input.positioner_options, is_noisy);
  const auto tilt_rad = fixes ? find_tilt_rad(*fixes) : std::nullopt;
  if (!tilt_rad) return std::nullopt;
  return Explanation{
      estimate_noise_px(sum_fix_residuals(*fixes)).value_or(0),
      // [FIX-14] `fit a tilted camera`
      fmt::format("the images fit a tilted camera, by {:.2g} degrees: state inclinations in "
                  "captures.csv, or --roll-pitch-sd-deg",
                  deg_from_rad(*tilt_rad))};
}

/// Warns if motion or tilt explains failed frames or residuals of a camera that is assumed to stand
/// or to be level. Names the one that leaves less noise.
void warn_about_motion(LocateResult& result, const LocateInput& input, bool is_noisy) {
  const std::size_t failed = input.frames.size() - count_fixes(result.fixes);
  if (!is_noisy && 2 * failed < input.frames.size()) return;
  const auto motion = explain_by_motion(result, input, is_noisy);
  const auto tilt = explain_by_tilt(result, input, is_noisy);
  if (motion && !(tilt && tilt->noise_px < motion->noise_px)) {
    result.warnings.push_back(motion->warning);
  } else if (tilt) {
    result.warnings.push_back(tilt->warning);
  }
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
void locate_scaled(const LocateInput& input, const PositionerOptions& positioner_options,
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

/// Estimates the noise of the frames of which all detections state one, or of the others.
NoiseScale estimate_scale(const LocateInput& input, const std::vector<Fix>& fixes, bool is_stated) {
  std::vector<Frame> frames;
  std::vector<Fix> selected;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (has_pixel_noise(input.frames[i]) != is_stated) continue;
    frames.push_back(input.frames[i]);
    selected.push_back(fixes[i]);
  }
  return estimate_noise_scale(
      frames, selected, Positioner(input.lamps, input.calibration, input.positioner_options),
      input.lamps, input.calibration, input.positioner_options.unstated_sigma_px);
}

/// Locates all frames. Uses the noise estimated from the residuals if none is given or the given
/// one is too small. Returns true if the noise is known.
bool locate_with_noise(const LocateInput& input, LocateResult& result) {
  PositionerOptions positioner_options = input.positioner_options;
  result.fixes = locate_all_frames(input, positioner_options);
  const NoiseScale stated = estimate_scale(input, result.fixes, true);
  const NoiseScale unstated = estimate_scale(input, result.fixes, false);
  const bool are_all_stated = std::ranges::all_of(input.frames, has_pixel_noise);
  // Fewer degrees of freedom determine the factor to 22 % at best.
  constexpr double min_degrees_of_freedom = 10;
  const double factor =
      stated.degrees_of_freedom >= min_degrees_of_freedom ? std::max(1.0, stated.factor) : 1;
  bool is_noisy = false;
  if (are_all_stated) is_noisy = warn_about_noise(result, input.frames, factor);
  warn_about_motion(result, input, is_noisy);
  constexpr double chance_sds = 3;
  if (!is_noisy && factor > 1 + chance_sds * std::sqrt(0.5 / stated.degrees_of_freedom)) {
    result.notes.push_back(fmt::format(
        "residuals are {:.2f} times the stated noise: sd follows the residuals", factor));
  }
  bool is_known = true;
  if (!are_all_stated) {
    // Few frames without given noise may have no redundancy: then the noise in pixels is estimated
    // from all frames.
    const auto unstated_factor = unstated.degrees_of_freedom > 0
                                     ? std::optional(unstated.factor)
                                     : estimate_noise_px(sum_fix_residuals(result.fixes));
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
  if (factor > 1 || (is_known && !are_all_stated)) {
    locate_scaled(input, positioner_options, factor, result.fixes);
  }
  return is_known;
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
    if (inclination) inclination = turn_over_if(below, *inclination);
  }
  if (const auto& mount = input.positioner_options.mount)
    options.yaw_in_robot_rad = turn_over_if(below, *mount).yaw_in_robot_rad;
  if (input.compute_lamp_offsets) options.max_captures = std::max<std::size_t>(frames.size(), 1);
  MapErrors found =
      detect_map_errors(frames, turn_over_if(below, input.lamps), input.calibration, options);
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
  intake.set_repetition(
      [&](const std::string& image, std::vector<Light> lights, const LightsInPlane& detect) {
        return repeat_if_tilted(input, positioner, image, std::move(lights), detect);
      });
  Observations seen = intake.detect_in_all(list_lamp_images(images.images), progress);
  check_any_identified(images, seen);
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
