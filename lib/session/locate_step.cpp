// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/locate_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>

#include "camera/lens.h"
#include "captures/outside_image.h"
#include "geometry/median.h"
#include "geometry/polygon.h"
#include "positioning/correction.h"
#include "positioning/inclination_rotation.h"
#include "positioning/known_motion.h"
#include "positioning/residual_noise.h"
#include "rig/find_lamp.h"
#include "session/capture_motion.h"
#include "session/lamp_offsets.h"

namespace vlp {

Sensors sensors_of(const std::string& image, const LocateInput& input) {
  Sensors sensors;
  sensors.motion = input.motion;
  sensors.inclination_sigma_rad = input.lean_sd_rad;
  const auto entry = input.captures.find(image);
  if (entry == input.captures.end()) return sensors;
  const Capture& capture = entry->second;
  sensors.motion = motion_of(capture, input.motion, input.yaw_rate_sd_rad_per_s);
  sensors.time_s = capture.time_s;
  if (capture.inclination) {
    sensors.inclination = capture.inclination;
    sensors.inclination_sigma_rad = input.inclination_sigma_rad;
  }
  if (input.one_lamp && capture.z_m && capture.yaw_rad) {
    sensors.height_and_yaw = HeightAndYaw{*capture.z_m, *capture.yaw_rad};
  }
  if (input.height_sd_m && capture.z_m) {
    // The table's is the camera's.
    const double above_m = input.how.mount ? input.how.mount->position_in_robot_m.z() : 0;
    sensors.height = KnownHeight{*capture.z_m - above_m, *input.height_sd_m};
  }
  return sensors;
}

namespace {

/// The frames that come within this before each, latest first, by their time stamps.
constexpr double kLongestTogether_s = 0.2;

class EarlierFrames {
 public:
  explicit EarlierFrames(const LocateInput& input) : input_(input) {
    if (input.frames_together < 2) return;
    for (std::size_t i = 0; i < input.frames.size(); ++i) {
      const auto entry = input.captures.find(input.frames[i].image);
      if (entry == input.captures.end() || !entry->second.time_s) continue;
      by_time_.emplace(*entry->second.time_s, i);
    }
  }
  std::vector<EarlierFrame> before(const std::optional<double>& time_s) const {
    std::vector<EarlierFrame> earlier;
    if (!time_s) return earlier;
    auto at = by_time_.lower_bound(*time_s);
    while (at != by_time_.begin() &&
           earlier.size() + 1 < static_cast<std::size_t>(input_.frames_together)) {
      --at;
      const double before_s = *time_s - at->first;
      constexpr double rounding_s = 1e-6;
      if (before_s > kLongestTogether_s + rounding_s) break;
      earlier.push_back({input_.frames[at->second].detections, before_s});
    }
    return earlier;
  }

 private:
  const LocateInput& input_;
  std::multimap<double, std::size_t> by_time_;
};

/// What drove otherwise in between, or was another pass, is fixed by itself.
Fix fix_of(const Frame& frame, const Positioner& positioner, const EarlierFrames& frames,
           const Sensors& sensors) {
  const auto earlier = frames.before(sensors.time_s);
  if (!earlier.empty() && sensors.motion) {
    const Fix together = positioner.locate(frame.detections, sensors, earlier);
    if (together.ok()) return together;
  }
  return positioner.locate(frame.detections, sensors);
}

std::vector<Fix> locate_all(const LocateInput& input, const PositionerOptions& how) {
  const Positioner positioner(input.lamps, input.calibration, how);
  const EarlierFrames frames(input);
  std::vector<Fix> fixes;
  fixes.reserve(input.frames.size());
  for (const Frame& frame : input.frames) {
    fixes.push_back(fix_of(frame, positioner, frames, sensors_of(frame.image, input)));
  }
  return fixes;
}

void check_motion(const LocateInput& input) {
  const bool motion =
      input.motion ||
      std::any_of(input.frames.begin(), input.frames.end(), [&](const Frame& frame) {
        const auto known = sensors_of(frame.image, input).motion;
        return known && moves(*known);
      });
  if (motion) check_row_time(input.calibration.camera);
}

/// Returns the input with the stated noise in all detections.
LocateInput with_sigma(LocateInput input) {
  for (Frame& frame : input.frames) {
    for (Detection& detection : frame.detections) detection.sigma_px = input.sigma_px;
  }
  input.sigma_px.reset();
  return input;
}

bool states_sigma(const Frame& frame) {
  return std::all_of(frame.detections.begin(), frame.detections.end(),
                     [](const Detection& detection) { return detection.sigma_px.has_value(); });
}

FixRow row_of(const Frame& frame, const CapturesTable& captures, const Fix& fix, bool noise_known) {
  FixRow row{frame.image, std::string(name_of(fix.status)), {}, fix.lamps};
  if (const auto entry = captures.find(frame.image); entry != captures.end()) {
    row.time_s = entry->second.time_s;
  }
  if (!fix.ok()) return row;
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
  const auto listed =
      std::min<std::size_t>(fix.rejected_ids.size(), static_cast<std::size_t>(fix.rejected_lamps));
  row.rejected.assign(fix.rejected_ids.begin(), fix.rejected_ids.begin() + std::ptrdiff_t(listed));
  return row;
}

void warn_of_noise(LocateResult& result, const std::vector<Frame>& frames) {
  double stated_px = 0;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      stated_px = std::max(stated_px, detection.sigma_px.value_or(0));
    }
  }
  constexpr double too_noisy = 3;
  const auto shown_px = residual_noise_px(result.fixes);
  if (shown_px && stated_px > 0) {
    result.metrics.push_back({"residual_ratio", *shown_px / stated_px});
  }
  if (!shown_px || *shown_px <= too_noisy * stated_px) return;
  result.warnings.push_back(fmt::format(
      "the residuals show {:.2g} px of noise, {:.2g} px are stated: sd is too small; are "
      "calibration and lamp map right and complete?",
      *shown_px, stated_px));
}

void warn_of_map(LocateResult& result, const LocateInput& input) {
  const int elsewhere = Positioner(input.lamps, input.calibration, input.how).lamps_elsewhere();
  if (elsewhere > 0) result.warnings.push_back(words_of_lamps_elsewhere(elsewhere));
}

void warn_of_image(LocateResult& result, const LocateInput& input) {
  const auto& [width, height] = input.calibration.camera.imager_px;
  const std::size_t outside = count_far_outside(input.frames, {width, height});
  if (outside == 0) return;
  result.warnings.push_back(fmt::format(
      "{} detections far outside the camera's {} x {} px: is the calibration this camera's?",
      outside, width, height));
}

/// A lens that boards showed in part of the image is only known there. Marks the fixes that rest on
/// lamps elsewhere.
void mark_outside_region(LocateResult& result, const LocateInput& input) {
  const auto& report = input.calibration.intrinsics_report;
  if (!report || report->region_px.empty()) return;
  std::size_t outside = 0, fixes = 0;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    if (!result.fixes[i].ok()) continue;
    ++fixes;
    const auto& detections = input.frames[i].detections;
    const auto& rejected = result.rows[i].rejected;
    auto& marked = result.rows[i].outside_region;
    for (const Detection& one : detections) {
      if (polygon_contains(report->region_px, one.pixel)) continue;
      if (find_lamp(input.lamps.lamps, one.lamp) == nullptr) continue;
      if (std::find(rejected.begin(), rejected.end(), one.lamp) != rejected.end()) continue;
      marked.push_back(one.lamp);
    }
    if (marked.empty()) continue;
    ++outside;
    result.details.push_back(fmt::format("{}: {} of {} lamps are where the lens is not known",
                                         input.frames[i].image, marked.size(), detections.size()));
  }
  if (outside == 0) return;
  result.warnings.push_back(fmt::format(
      "{} of {} fixes rest on lamps where no board was seen (region_px of the calibration; "
      "outside_region of the fixes says which): the lens may be wrong there; add views of the "
      "board there",
      outside, fixes));
}

void warn_of_captures(LocateResult& result, const LocateInput& input) {
  const auto& captures = input.captures;
  const auto without = std::count_if(
      input.frames.begin(), input.frames.end(),
      [&](const Frame& frame) { return captures.find(frame.image) == captures.end(); });
  if (captures.empty() || without == 0) return;
  result.warnings.push_back(fmt::format(
      "{} of {} images are not in captures.csv: image names have to be equal (here '{}', "
      "there '{}')",
      without, input.frames.size(), input.frames.front().image, captures.begin()->first));
}

/// From its place in the map to where a lamp is seen, on the ceiling; nothing where that is not
/// known: with a mount fixes are not of the camera.
std::optional<Eigen::Vector2d> off_m(const LocateInput& input, std::size_t frame, const Fix& fix,
                                     int id, const Lens& lens,
                                     const Eigen::Matrix3d& base_from_camera) {
  const Lamp* lamp = find_lamp(input.lamps.lamps, id);
  if (lamp == nullptr || input.how.mount) return std::nullopt;
  const auto& [image, detections] = input.frames[frame];
  const auto detection = std::find_if(detections.begin(), detections.end(),
                                      [&](const Detection& one) { return one.lamp == id; });
  if (detection == detections.end()) return std::nullopt;
  const auto ray = lens.unproject(detection->pixel);
  if (!ray) return std::nullopt;
  const auto inclination =
      fix.body ? std::optional(fix.body->inclination) : sensors_of(image, input).inclination;
  const InclinationRotation lean =
      inclination ? inclination_rotation(*inclination, 0) : InclinationRotation();
  const Eigen::Vector3d level = lean.level_from_base * base_from_camera * ray->direction;
  if (!(level.z() > 0)) return std::nullopt;
  const Pose& pose = fix.estimate.pose;
  const double height_m = lamp->position_m.z() - pose.position_m.z();
  const Eigen::Vector3d seen_m =
      pose.position_m + rotation_about_z(pose.yaw_rad) * level * (height_m / level.z());
  return (seen_m - lamp->position_m).head<2>();
}

bool has_a_lamp_twice(const std::vector<Detection>& detections) {
  std::set<int> ids;
  for (const Detection& one : detections) ids.insert(one.lamp);
  return ids.size() < detections.size();
}

/// What the fixes see.
std::vector<CeilingView> ceiling_views(const LocateInput& input, const std::vector<Fix>& fixes) {
  const Lens lens(input.calibration.camera.lens_model, input.calibration.camera.intrinsics);
  const Eigen::Matrix3d base_from_camera =
      level_from_camera(input.calibration, input.how.correction);
  std::vector<CeilingView> views;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const auto& detections = input.frames[i].detections;
    if (has_a_lamp_twice(detections)) continue;  // which of the two it is nobody knows
    if (!fixes[i].ok() || fixes[i].lamps < 2) continue;
    const Eigen::Vector3d& camera_m = fixes[i].estimate.pose.position_m;
    CeilingView view{camera_m.head<2>(), {}};
    for (const Detection& one : detections) {
      const auto off = off_m(input, i, fixes[i], one.lamp, lens, base_from_camera);
      if (!off) continue;
      const Eigen::Vector3d& map_m = find_lamp(input.lamps.lamps, one.lamp)->position_m;
      view.lamps.push_back({one.lamp, map_m.head<2>() + *off, map_m.z() - camera_m.z()});
    }
    views.push_back(std::move(view));
  }
  return views;
}

void tell_of_lamps_left_out(LocateResult& result, const LocateInput& input) {
  const Lens lens(input.calibration.camera.lens_model, input.calibration.camera.intrinsics);
  const Eigen::Matrix3d base_from_camera =
      level_from_camera(input.calibration, input.how.correction);
  int unknown = 0, rejected = 0;
  struct LeftOut {
    int captures = 0;
    std::vector<double> off_m = {};
  };
  std::map<int, LeftOut> lamps;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const Fix& fix = result.fixes[i];
    unknown += fix.unknown_lamps;
    rejected += fix.rejected_lamps;
    for (const int id : result.rows[i].rejected) {
      LeftOut& lamp = lamps[id];
      ++lamp.captures;
      if (const auto off = off_m(input, i, fix, id, lens, base_from_camera)) {
        lamp.off_m.push_back(off->norm());
      }
      result.details.push_back(fmt::format("{}: lamp {} contradicts the others and is left out",
                                           input.frames[i].image, id));
    }
  }
  if (unknown > 0) {
    result.warnings.push_back(
        fmt::format("{} detections of lamps that are not in the map, left out", unknown));
  }
  if (rejected > 0) {
    result.warnings.push_back(
        fmt::format("{} detections that contradict the others, left out", rejected));
  }
  for (auto& [id, lamp] : lamps) {
    result.lamps_left_out.push_back({id, lamp.captures});
    std::string words = fmt::format("lamp {} is left out of {} of {} captures", id, lamp.captures,
                                    input.frames.size());
    if (!lamp.off_m.empty()) {
      words += fmt::format(": {:.0f} mm off", 1e3 * upper_median(std::move(lamp.off_m)));
    }
    result.warnings.push_back(std::move(words));
  }
}

}  // namespace

std::string words_of_lamps_elsewhere(int lamps) {
  return fmt::format(
      "{} lamps are elsewhere than in the adjustment of the calibration, and sd does not "
      "know how well they are: give the map that vlp-adjust --refine-map wrote with it",
      lamps);
}

LocateResult locate_frames(const LocateInput& input) {
  if (input.sigma_px) return locate_frames(with_sigma(input));
  check_motion(input);
  LocateResult result;
  PositionerOptions how = input.how;
  result.fixes = locate_all(input, how);
  const bool stated = std::all_of(input.frames.begin(), input.frames.end(), states_sigma);
  bool noise_known = stated;
  if (!stated) {
    if (const auto noise_px = residual_noise_px(result.fixes)) {
      result.notes.push_back(
          fmt::format("sigma_px is not stated: {:.3g} px taken from the residuals", *noise_px));
      how.unstated_sigma_px = *noise_px;
      noise_known = true;
      result.fixes = locate_all(input, how);
    } else {
      result.warnings.emplace_back(
          "sigma_px is not stated and no residuals show it: sd columns are empty");
    }
  }
  if (stated) warn_of_noise(result, input.frames);
  result.rows.reserve(result.fixes.size());
  for (std::size_t i = 0; i < result.fixes.size(); ++i) {
    result.rows.push_back(row_of(input.frames[i], input.captures, result.fixes[i], noise_known));
  }
  warn_of_image(result, input);
  mark_outside_region(result, input);
  warn_of_map(result, input);
  warn_of_captures(result, input);
  tell_of_lamps_left_out(result, input);
  if (input.lamp_offsets) {
    auto views = ceiling_views(input, result.fixes);
    const bool several = views.size() > 1;
    result.lamp_offsets = offsets_of_lamps(input.lamps, std::move(views));
    if (several && result.lamp_offsets.empty()) {
      result.notes.push_back(
          "where the other lamps see each lamp is not told: captures do not tie all lamps "
          "together");
    }
  }
  result.summary = summarize(result.rows);
  if (result.summary.fixes == 0) {
    result.fail(StepFailure::undetermined,
                fmt::format("no frame has a fix; the first: {}",
                            explanation_of(result.fixes.front().status)));
  }
  return result;
}

}  // namespace vlp
