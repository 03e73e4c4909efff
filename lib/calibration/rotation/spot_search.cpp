// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/spot_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "geometry/median.h"
#include "positioning/positioner.h"

namespace vlp {

namespace {

/// Returns the reason why there are too few fixes.
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

}  // namespace

SpotSearch::SpotSearch(const std::vector<Frame>& frames, const LampMap& map, const Camera& camera,
                       double noise_px, bool lever_arm)
    : frames_(frames),
      map_(map),
      lamps_z_m_(mean_height(map)),
      noise_px_(noise_px),
      lever_arm_(lever_arm),
      left_out_(frames.size()) {
  calibration_.camera = camera;
  calibration_.rotation_center = {RotationModel::tilt, {0, 0}, Eigen::Vector3d::UnitZ()};
  // Removes sigma_px, because a tilt that is not corrected yet is no noise.
  for (Frame& frame : frames_) {
    for (Detection& detection : frame.detections) detection.sigma_px.reset();
  }
}

SpotStatus SpotSearch::run() {
  constexpr int rough_rounds = 4, rounds = 40;
  for (int round = 0; round < rounds && !(round > rough_rounds && settled()); ++round) {
    // The tolerance is larger while the tilt is not corrected, because lamps contradict each other
    // then.
    locate(round < rough_rounds ? 0.3 : PositionerOptions().max_residual_share);
    if (fixes_.fixes.size() < kLeastCaptures) return status_of(statuses_);
    if (round >= rough_rounds) tell_heights_apart(fixes_, height_noise_m_);
    const bool rough_arm = round < rough_rounds && lever_arm_;
    if (const SpotStatus status = turn(rough_arm); status != SpotStatus::ok) return status;
  }
  if (misfit_m() > 0.05 * height_of(fixes_, 0)) return SpotStatus::moved;
  leave_out_strays();
  locate(PositionerOptions().max_residual_share);
  tell_heights_apart(fixes_, height_noise_m_);
  return turn(false);
}

SpotCaptures SpotSearch::result() const {
  SpotCaptures spot;
  spot.zenith_in_camera = calibration_.rotation_center->zenith_in_camera;
  spot.lever_arm_m = turning_.lever_arm_m;
  const auto arcs = arcs_of(fixes_);
  for (std::size_t i = 0; i < fixes_.spots; ++i) {
    spot.heights.push_back({lamps_z_m_ - height_of(fixes_, i), turning_.axes_m[i], arcs[i].arc_rad,
                            static_cast<int>(arcs[i].captures)});
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

void SpotSearch::locate(double max_residual_share) {
  PositionerOptions options;
  options.max_residual_share = max_residual_share;
  const Positioner positioner(map_, calibration_, options);
  fixes_ = {};
  statuses_.clear();
  std::vector<Fix> found;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (strays_.contains(i)) continue;
    const Fix fix = positioner.locate(frames_[i].detections);
    statuses_.push_back(fix.status);
    left_out_[i] = fix.ok() ? "" : explanation_of(fix.status);
    if (!fix.ok()) continue;
    const Pose& pose = fix.estimate.pose;
    fixes_.frames.push_back(i);
    fixes_.fixes.push_back({pose, lamps_z_m_ - pose.position_m.z(), 0});
    found.push_back(fix);
  }
  height_noise_m_ = height_noise_m(found);
}

/// Estimates the standard deviation of the height of a fix from the residuals, which include the
/// tilt that is not corrected yet.
double SpotSearch::height_noise_m(const std::vector<Fix>& fixes) const {
  std::vector<double> of_two, of_more;
  for (const Fix& fix : fixes) {
    const double of_1px_m = std::sqrt(fix.noise_covariance(2, 2));
    const double n = fix.lamps;
    if (fix.lamps > 2) {
      of_more.push_back(of_1px_m * fix.residual_px * std::sqrt(n / (2 * n - 4)));
    } else {
      of_two.push_back(of_1px_m * noise_px_);
    }
  }
  if (!of_more.empty()) return upper_median(std::move(of_more));
  return of_two.empty() ? 0 : upper_median(std::move(of_two));
}

SpotStatus SpotSearch::turn(bool lever_arm) {
  const auto arcs = arcs_of(fixes_);
  if (const SpotStatus status = vlp::status_of(arcs); status != SpotStatus::ok) return status;
  for (const std::size_t i : fixes_.frames)
    left_out_[i] = "too few captures, or too small an arc, at its height";
  drop_weak_spots(fixes_, arcs);
  for (const std::size_t i : fixes_.frames) left_out_[i].clear();
  turning_ = fit_turning(fixes_.fixes, fixes_.spots, lever_arm || fixes_.spots > 1);
  const Eigen::Vector3d up(-turning_.delta.x(), -turning_.delta.y(), 1);
  zenith() = (level_from_zenith(zenith()).transpose() * up).normalized();
  // Three captures and a lever arm have no redundancy: noise can move the zenith anywhere.
  return zenith().z() > 0 ? SpotStatus::ok : SpotStatus::moved;
}

bool SpotSearch::settled() const {
  constexpr double enough_rad = 1e-10;
  return turning_.delta.norm() < enough_rad;
}

void SpotSearch::leave_out_strays() {
  const double far_m = std::max(8 * misfit_m(), 0.01 * height_of(fixes_, 0));
  for (std::size_t i = 0; i < fixes_.fixes.size(); ++i) {
    if (!(turning_.residuals_m[i] > far_m)) continue;
    strays_.insert(fixes_.frames[i]);
    left_out_[fixes_.frames[i]] = "its fix is not where the others turn";
  }
}

namespace {

bool determines(const SpotArc& spot) {
  return spot.captures >= kLeastCaptures && spot.arc_rad >= kLeastArc_rad;
}

}  // namespace

void tell_heights_apart(SpotFixes& fixes, double noise_m) {
  constexpr double clear_sigmas = 3;
  std::vector<std::size_t> order(fixes.fixes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return fixes.fixes[a].height_m > fixes.fixes[b].height_m;
  });
  fixes.spots = 0;
  double last_m = 0;
  for (const std::size_t i : order) {
    const double height_m = fixes.fixes[i].height_m;
    const double gap_m = std::max(clear_sigmas * noise_m, kLeastGap * last_m);
    if (fixes.spots == 0 || last_m - height_m > gap_m) ++fixes.spots;
    fixes.fixes[i].spot = fixes.spots - 1;
    last_m = height_m;
  }
}

std::vector<SpotArc> arcs_of(const SpotFixes& fixes) {
  std::vector<std::vector<double>> yaws_rad(fixes.spots);
  for (const TurningFix& fix : fixes.fixes) yaws_rad[fix.spot].push_back(fix.pose.yaw_rad);
  std::vector<SpotArc> arcs;
  arcs.reserve(fixes.spots);
  for (const auto& yaws : yaws_rad) arcs.push_back({yaws.size(), arc_of(yaws)});
  return arcs;
}

SpotStatus status_of(const std::vector<SpotArc>& arcs) {
  constexpr double alike_rad = 0.05;
  SpotStatus status = SpotStatus::too_few_captures;
  bool turned = false;
  for (const SpotArc& spot : arcs) {
    if (determines(spot)) return SpotStatus::ok;
    if (spot.captures < kLeastCaptures) continue;
    turned = turned || spot.arc_rad > alike_rad;
    status = turned ? SpotStatus::short_arc : SpotStatus::alike;
  }
  return status;
}

void drop_weak_spots(SpotFixes& fixes, const std::vector<SpotArc>& arcs) {
  std::vector<std::size_t> place(fixes.spots);
  SpotFixes kept;
  kept.spots = 0;
  for (std::size_t spot = 0; spot < fixes.spots; ++spot) {
    place[spot] = kept.spots;
    if (determines(arcs[spot])) ++kept.spots;
  }
  for (std::size_t i = 0; i < fixes.fixes.size(); ++i) {
    TurningFix fix = fixes.fixes[i];
    if (!determines(arcs[fix.spot])) continue;
    fix.spot = place[fix.spot];
    kept.frames.push_back(fixes.frames[i]);
    kept.fixes.push_back(fix);
  }
  fixes = std::move(kept);
}

double height_of(const SpotFixes& fixes, std::size_t spot) {
  std::vector<double> heights_m;
  for (const TurningFix& fix : fixes.fixes) {
    if (fix.spot == spot) heights_m.push_back(fix.height_m);
  }
  return upper_median(heights_m);
}

}  // namespace vlp
