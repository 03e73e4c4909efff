// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/locate_frames.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "geometry/angles.h"
#include "geometry/median.h"
#include "positioning/known_motion.h"
#include "positioning/residual_noise.h"
#include "positioning/row_clock.h"
#include "session/pixel_noise.h"

namespace vlp {

std::span<const int> list_rejected(const Fix& fix) {
  const auto count = static_cast<std::size_t>(fix.rejected_lamps);
  return std::span(fix.rejected_ids).first(std::min(fix.rejected_ids.size(), count));
}

bool is_state_estimated(const Fix& fix, int state) { return fix.covariance(state, state) > 0; }

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

bool has_pixel_noise(const Frame& frame) {
  return std::all_of(frame.detections.begin(), frame.detections.end(),
                     [](const Detection& detection) { return detection.sigma_px.has_value(); });
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

/// Value that a fix estimates, and its standard deviation.
struct Estimate {
  double value, sd;
};

Estimate estimate_speed_m_per_s(const Fix& fix) {
  const double variance = fix.covariance.block<2, 2>(kBodyVelocity, kBodyVelocity).trace() / 2;
  return {fix.state.motion.velocity_m_per_s.norm(), std::sqrt(variance)};
}

/// Estimates the angle between the camera and the vertical.
Estimate estimate_tilt_rad(const Fix& fix) {
  const auto& [roll_rad, pitch_rad] = fix.state.motion.inclination;
  return {std::hypot(roll_rad, pitch_rad),
          std::sqrt(fix.covariance.diagonal().tail<2>().maxCoeff())};
}

/// Returns the median of the estimates of the fixes that estimate a state, if it is significant.
std::optional<double> find_significant_median(const std::vector<Fix>& fixes, int state,
                                              Estimate (*estimate)(const Fix& fix)) {
  std::vector<double> values, sigmas;
  for (const Fix& fix : fixes) {
    if (!fix.has_succeeded() || !is_state_estimated(fix, state)) continue;
    const auto [value, sd] = estimate(fix);
    values.push_back(value);
    sigmas.push_back(value / sd);
  }
  constexpr double min_sigmas = 3;
  if (values.empty() || upper_median(sigmas) < min_sigmas) return std::nullopt;
  return upper_median(values);
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
  const auto speed_m_per_s =
      fixes ? find_significant_median(*fixes, kBodyVelocity, estimate_speed_m_per_s) : std::nullopt;
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
  const auto tilt_rad =
      fixes ? find_significant_median(*fixes, kBodyRoll, estimate_tilt_rad) : std::nullopt;
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

}  // namespace

bool locate_frames(const LocateInput& input, LocateResult& result) {
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

}  // namespace vlp
