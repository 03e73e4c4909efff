// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/spot_captures.h"

#include <algorithm>
#include <set>
#include <utility>

#include "calibration/spot_fixes.h"
#include "positioning/positioner.h"

namespace vlp {
namespace {

SpotStatus status_of(const std::vector<Frame>& frames, const LampMap& map) {
  std::set<int> known, seen;
  for (const Lamp& lamp : map.lamps) known.insert(lamp.id);
  std::size_t captures = 0;
  for (const Frame& frame : frames) {
    if (!frame.detections.empty()) ++captures;
    for (const Detection& detection : frame.detections) {
      if (known.contains(detection.lamp)) seen.insert(detection.lamp);
    }
  }
  if (seen.empty()) return SpotStatus::other_map;
  if (captures < kLeastCaptures) return SpotStatus::too_few_captures;
  return seen.size() < 2 ? SpotStatus::too_few_lamps : SpotStatus::ok;
}

/// Why there are too few fixes.
SpotStatus status_of(const std::vector<FixStatus>& statuses) {
  const auto count = [&](FixStatus status) {
    return std::count(statuses.begin(), statuses.end(), status);
  };
  const auto few = count(FixStatus::too_few_lamps);
  const auto contradicting = count(FixStatus::inconsistent) + count(FixStatus::mirrored_map) +
                             count(FixStatus::degenerate) + count(FixStatus::lamp_below_camera);
  if (contradicting > few) return SpotStatus::other_map;
  return few > 0 ? SpotStatus::too_few_lamps : SpotStatus::too_few_captures;
}

double mean_height(const LampMap& map) {
  double sum = 0;
  for (const Lamp& lamp : map.lamps) sum += lamp.position_m.z();
  return sum / static_cast<double>(map.lamps.size());
}

/// The search for the turning, see SpotCaptures.
class Search {
 public:
  /// With `lever_arm` it looks for one before it knows the heights.
  Search(const std::vector<Frame>& frames, const LampMap& map, const Camera& camera, bool lever_arm)
      : frames_(frames),
        map_(map),
        lamps_z_m_(mean_height(map)),
        lever_arm_(lever_arm),
        left_out_(frames.size()) {
    calibration_.camera = camera;
    calibration_.rotation_center = {RotationModel::tilt, {0, 0}, Eigen::Vector3d::UnitZ()};
    // A tilt that is not corrected yet is not noise.
    for (Frame& frame : frames_) {
      for (Detection& detection : frame.detections) detection.sigma_px.reset();
    }
  }

  SpotStatus run() {
    constexpr int rough_rounds = 4, rounds = 40;
    for (int round = 0; round < rounds && !(round > rough_rounds && settled()); ++round) {
      // Lamps contradict each other a little while the tilt is in them.
      locate(round < rough_rounds ? 0.3 : PositionerOptions().max_residual_share);
      if (fixes_.fixes.size() < kLeastCaptures) return status_of(statuses_);
      if (round >= rough_rounds) tell_heights_apart(fixes_);
      const bool rough_arm = round < rough_rounds && lever_arm_;
      if (const SpotStatus status = turn(rough_arm); status != SpotStatus::ok) return status;
    }
    if (misfit_m() > 0.05 * height_of(fixes_, 0)) return SpotStatus::moved;
    leave_out_strays();
    locate(PositionerOptions().max_residual_share);
    tell_heights_apart(fixes_);
    return turn(false);
  }

  /// How far, typically, the fixes are from where they turn.
  double misfit_m() const { return median_of(turning_.residuals_m); }

  /// After a run that ended well.
  SpotCaptures result() const {
    SpotCaptures spot;
    spot.zenith_in_camera = zenith();
    spot.lever_arm_m = turning_.lever_arm_m;
    const auto arcs = arcs_of(fixes_);
    for (std::size_t i = 0; i < fixes_.spots; ++i) {
      spot.heights.push_back({lamps_z_m_ - height_of(fixes_, i), turning_.axes_m[i],
                              arcs[i].arc_rad, static_cast<int>(arcs[i].captures)});
    }
    for (std::size_t i = 0; i < fixes_.fixes.size(); ++i) {
      const TurningFix& fix = fixes_.fixes[i];
      spot.captures.push_back({frames_[fixes_.frames[i]].image, fix.spot, fix.pose.yaw_rad});
    }
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (!left_out_[i].empty()) spot.left_out.push_back({frames_[i].image, left_out_[i]});
    }
    return spot;
  }

  const std::vector<std::size_t>& frames() const { return fixes_.frames; }

 private:
  Eigen::Vector3d& zenith() { return calibration_.rotation_center->zenith_in_camera; }
  const Eigen::Vector3d& zenith() const { return calibration_.rotation_center->zenith_in_camera; }

  void locate(double max_residual_share) {
    PositionerOptions options;
    options.max_residual_share = max_residual_share;
    const Positioner positioner(map_, calibration_, options);
    fixes_ = {};
    statuses_.clear();
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (strays_.contains(i)) continue;
      const Fix fix = positioner.locate(frames_[i].detections);
      statuses_.push_back(fix.status);
      left_out_[i] = fix.ok() ? "" : explanation_of(fix.status);
      if (!fix.ok()) continue;
      const Pose& pose = fix.estimate.pose;
      fixes_.frames.push_back(i);
      fixes_.fixes.push_back({pose, lamps_z_m_ - pose.position_m.z(), 0});
    }
  }

  SpotStatus turn(bool lever_arm) {
    const auto arcs = arcs_of(fixes_);
    if (const SpotStatus status = vlp::status_of(arcs); status != SpotStatus::ok) return status;
    for (const std::size_t i : fixes_.frames) left_out_[i] = "its height has too few captures";
    drop_weak_spots(fixes_, arcs);
    for (const std::size_t i : fixes_.frames) left_out_[i].clear();
    turning_ = fit_turning(fixes_.fixes, fixes_.spots, lever_arm || fixes_.spots > 1);
    const Eigen::Vector3d up(-turning_.delta.x(), -turning_.delta.y(), 1);
    zenith() = (level_from_zenith(zenith()).transpose() * up).normalized();
    return SpotStatus::ok;
  }

  bool settled() const {
    constexpr double enough_rad = 1e-10;
    return turning_.delta.norm() < enough_rad;
  }

  void leave_out_strays() {
    const double far_m = std::max(8 * misfit_m(), 0.01 * height_of(fixes_, 0));
    for (std::size_t i = 0; i < fixes_.fixes.size(); ++i) {
      if (!(turning_.residuals_m[i] > far_m)) continue;
      strays_.insert(fixes_.frames[i]);
      left_out_[fixes_.frames[i]] = "its fix is not where the others turn";
    }
  }

  std::vector<Frame> frames_;
  const LampMap& map_;
  double lamps_z_m_;
  bool lever_arm_;
  Calibration calibration_;
  std::vector<std::string> left_out_;  // why, for each frame; empty for those that are used
  std::set<std::size_t> strays_;
  std::vector<FixStatus> statuses_;
  SpotFixes fixes_;
  Turning turning_;
};

void add_sightings(SpotCaptures& spot, const Frame& frame, std::size_t capture, const Lens& lens) {
  for (const Detection& detection : frame.detections) {
    const auto lamp = std::find_if(spot.lamps.begin(), spot.lamps.end(),
                                   [&](const Lamp& one) { return one.id == detection.lamp; });
    const auto ray = lens.unproject(detection.pixel);
    if (lamp == spot.lamps.end() || !ray) continue;
    const Eigen::Vector3d unit = ray->direction.normalized();
    const auto projection = lens.project_with_jacobians(unit);
    if (!projection) continue;
    spot.sightings.push_back({capture, static_cast<std::size_t>(lamp - spot.lamps.begin()),
                              detection.pixel, detection.sigma_px.value_or(1), unit,
                              projection->d_pixel_d_point});
  }
}

}  // namespace

SpotCaptures spot_captures(const std::vector<Frame>& frames, const LampMap& map,
                           const Camera& camera) {
  SpotCaptures spot;
  spot.status = status_of(frames, map);
  if (spot.status != SpotStatus::ok) return spot;
  // A long lever arm that is taken for a tilt can hide that there are two heights; looked for at
  // one height, it can hide the tilt.
  Search plain(frames, map, camera, false), with_arm(frames, map, camera, true);
  spot.status = plain.run();
  const bool both = with_arm.run() == SpotStatus::ok;
  const bool better = both && (spot.status != SpotStatus::ok ||
                               with_arm.misfit_m() < 0.5 * plain.misfit_m() - 1e-9);
  if (better) spot.status = SpotStatus::ok;
  if (spot.status != SpotStatus::ok) return spot;
  const Search& search = better ? with_arm : plain;
  spot = search.result();
  std::set<int> seen;
  for (const std::size_t i : search.frames()) {
    for (const Detection& detection : frames[i].detections) seen.insert(detection.lamp);
  }
  for (const Lamp& lamp : map.lamps) {
    if (seen.contains(lamp.id)) spot.lamps.push_back(lamp);
  }
  const Lens lens(camera.lens_model, camera.intrinsics);
  for (std::size_t i = 0; i < search.frames().size(); ++i) {
    add_sightings(spot, frames[search.frames()[i]], i, lens);
  }
  return spot;
}

std::string_view explanation_of(SpotStatus status) {
  switch (status) {
    case SpotStatus::ok:
      return "captures of a turn on the spot";
    case SpotStatus::other_map:
      return "the lamps that are seen are not those of the lamp map, or not where it says: is it "
             "the map of this room?";
    case SpotStatus::too_few_lamps:
      return "two lamps or more are needed in each capture: add lamps, or turn where more of them "
             "are in view";
    case SpotStatus::too_few_captures:
      return "three captures or more are needed at a height: add captures while turning on the "
             "spot, twelve over a full turn are good";
    case SpotStatus::alike:
      return "the captures are all alike: turn the camera on the spot from one to the next";
    case SpotStatus::short_arc:
      return "the captures span less than 90 degrees: add captures over more of the turn, a full "
             "one is best";
    case SpotStatus::moved:
      return "the captures are not of one spot: take them while turning about one vertical axis, "
             "without driving";
  }
  return "";
}

}  // namespace vlp
