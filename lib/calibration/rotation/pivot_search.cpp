// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/pivot_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "geometry/median.h"
#include "positioning/positioner.h"

namespace vlp {

namespace {

/// Returns the reason why there are too few fixes.
RotationStatus find_status(const std::vector<FixStatus>& statuses) {
  const auto count = [&](FixStatus status) {
    return std::count(statuses.begin(), statuses.end(), status);
  };
  const auto few = count(FixStatus::too_few_lamps);
  const auto contradicting = count(FixStatus::inconsistent) + count(FixStatus::mirrored_map) +
                             count(FixStatus::degenerate) + count(FixStatus::lamp_below_camera);
  if (contradicting > few) return RotationStatus::other_map;
  return few > 0 ? RotationStatus::too_few_lamps : RotationStatus::too_few_captures;
}

double mean_height(const LampMap& map) {
  double sum = 0;
  for (const Lamp& lamp : map.lamps) sum += lamp.position_m.z();
  return sum / static_cast<double>(map.lamps.size());
}

}  // namespace

RotationSearch::RotationSearch(const std::vector<Frame>& frames, const LampMap& map,
                               const Camera& camera, double noise_px, bool lever_arm)
    : frames_(frames),
      map_(map),
      lamps_z_m_(mean_height(map)),
      noise_px_(noise_px),
      lever_arm_(lever_arm),
      rejection_reasons_(frames.size()) {
  calibration_.camera = camera;
  calibration_.rotation_center = {RotationModel::tilt, {0, 0}, Eigen::Vector3d::UnitZ()};
  // Removes sigma_px, because a tilt that is not corrected yet is no noise.
  for (Frame& frame : frames_) {
    for (Detection& detection : frame.detections) detection.sigma_px.reset();
  }
}

RotationStatus RotationSearch::run() {
  constexpr int num_rough_iterations = 4, max_iterations = 40;
  for (int iteration = 0;
       iteration < max_iterations && !(iteration > num_rough_iterations && has_converged());
       ++iteration) {
    // The tolerance is larger while the tilt is not corrected, because lamps contradict each other
    // then.
    locate(iteration < num_rough_iterations ? 0.3 : PositionerOptions().max_residual_share);
    if (fixes_.fixes.size() < kMinCaptures) return find_status(statuses_);
    if (iteration >= num_rough_iterations) cluster_by_height(fixes_, height_noise_m_);
    const bool estimates_arm = iteration < num_rough_iterations && lever_arm_;
    if (const RotationStatus status = fit_rotation(estimates_arm); status != RotationStatus::ok)
      return status;
  }
  if (median_residual_m() > 0.05 * compute_median_height(fixes_, 0)) return RotationStatus::moved;
  reject_outliers();
  locate(PositionerOptions().max_residual_share);
  cluster_by_height(fixes_, height_noise_m_);
  return fit_rotation(false);
}

RotationCaptures RotationSearch::result() const {
  RotationCaptures pivot;
  pivot.zenith_in_camera = calibration_.rotation_center->zenith_in_camera;
  pivot.lever_arm_m = model_fit_.lever_arm_m;
  const auto arcs = compute_pivot_arcs(fixes_);
  for (std::size_t i = 0; i < fixes_.num_pivots; ++i) {
    pivot.heights.push_back({lamps_z_m_ - compute_median_height(fixes_, i), model_fit_.axes_m[i],
                             arcs[i].arc_rad, static_cast<int>(arcs[i].captures)});
  }
  for (std::size_t i = 0; i < fixes_.fixes.size(); ++i) {
    const RotationFix& fix = fixes_.fixes[i];
    pivot.captures.push_back({frames_[fixes_.frames[i]].image, fix.pivot, fix.pose.yaw_rad});
  }
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (!rejection_reasons_[i].empty())
      pivot.rejected.push_back({frames_[i].image, rejection_reasons_[i]});
  }
  return pivot;
}

void RotationSearch::locate(double max_residual_share) {
  PositionerOptions options;
  options.max_residual_share = max_residual_share;
  const Positioner positioner(map_, calibration_, options);
  fixes_ = {};
  statuses_.clear();
  std::vector<Fix> found;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (outliers_.contains(i)) continue;
    const Fix fix = positioner.locate(frames_[i].detections);
    statuses_.push_back(fix.status);
    rejection_reasons_[i] = fix.ok() ? "" : describe(fix.status);
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
double RotationSearch::height_noise_m(const std::vector<Fix>& fixes) const {
  std::vector<double> two_lamp_sds_m, redundant_sds_m;
  for (const Fix& fix : fixes) {
    const double sd_per_px_m = std::sqrt(fix.noise_covariance(2, 2));
    const double n = fix.lamps;
    if (fix.lamps > 2) {
      redundant_sds_m.push_back(sd_per_px_m * fix.residual_px * std::sqrt(n / (2 * n - 4)));
    } else {
      two_lamp_sds_m.push_back(sd_per_px_m * noise_px_);
    }
  }
  if (!redundant_sds_m.empty()) return upper_median(std::move(redundant_sds_m));
  return two_lamp_sds_m.empty() ? 0 : upper_median(std::move(two_lamp_sds_m));
}

RotationStatus RotationSearch::fit_rotation(bool lever_arm) {
  const auto arcs = compute_pivot_arcs(fixes_);
  if (const RotationStatus status = vlp::find_status(arcs); status != RotationStatus::ok)
    return status;
  for (const std::size_t i : fixes_.frames)
    rejection_reasons_[i] = "too few captures, or too small an arc, at its height";
  reject_weak_pivots(fixes_, arcs);
  for (const std::size_t i : fixes_.frames) rejection_reasons_[i].clear();
  model_fit_ =
      fit_rotation_model(fixes_.fixes, fixes_.num_pivots, lever_arm || fixes_.num_pivots > 1);
  const Eigen::Vector3d up(-model_fit_.delta.x(), -model_fit_.delta.y(), 1);
  zenith() = (level_from_zenith(zenith()).transpose() * up).normalized();
  // Three captures and a lever arm have no redundancy: noise can move the zenith anywhere.
  return zenith().z() > 0 ? RotationStatus::ok : RotationStatus::moved;
}

bool RotationSearch::has_converged() const {
  constexpr double tolerance_rad = 1e-10;
  return model_fit_.delta.norm() < tolerance_rad;
}

void RotationSearch::reject_outliers() {
  const double max_residual_m =
      std::max(8 * median_residual_m(), 0.01 * compute_median_height(fixes_, 0));
  for (std::size_t i = 0; i < fixes_.fixes.size(); ++i) {
    if (!(model_fit_.residuals_m[i] > max_residual_m)) continue;
    outliers_.insert(fixes_.frames[i]);
    rejection_reasons_[fixes_.frames[i]] = "its fix is not where the others turn";
  }
}

namespace {

bool determines(const PivotArc& pivot) {
  return pivot.captures >= kMinCaptures && pivot.arc_rad >= kMinArc_rad;
}

}  // namespace

void cluster_by_height(PivotFixes& fixes, double noise_m) {
  constexpr double clear_sigmas = 3;
  std::vector<std::size_t> order(fixes.fixes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return fixes.fixes[a].height_m > fixes.fixes[b].height_m;
  });
  fixes.num_pivots = 0;
  double last_m = 0;
  for (const std::size_t i : order) {
    const double height_m = fixes.fixes[i].height_m;
    const double gap_m = std::max(clear_sigmas * noise_m, kMinHeightGapFraction * last_m);
    if (fixes.num_pivots == 0 || last_m - height_m > gap_m) ++fixes.num_pivots;
    fixes.fixes[i].pivot = fixes.num_pivots - 1;
    last_m = height_m;
  }
}

std::vector<PivotArc> compute_pivot_arcs(const PivotFixes& fixes) {
  std::vector<std::vector<double>> yaws_rad(fixes.num_pivots);
  for (const RotationFix& fix : fixes.fixes) yaws_rad[fix.pivot].push_back(fix.pose.yaw_rad);
  std::vector<PivotArc> arcs;
  arcs.reserve(fixes.num_pivots);
  for (const auto& yaws : yaws_rad) arcs.push_back({yaws.size(), compute_angular_range(yaws)});
  return arcs;
}

RotationStatus find_status(const std::vector<PivotArc>& arcs) {
  constexpr double max_equal_yaw_rad = 0.05;
  RotationStatus status = RotationStatus::too_few_captures;
  bool has_rotation = false;
  for (const PivotArc& pivot : arcs) {
    if (determines(pivot)) return RotationStatus::ok;
    if (pivot.captures < kMinCaptures) continue;
    has_rotation = has_rotation || pivot.arc_rad > max_equal_yaw_rad;
    status = has_rotation ? RotationStatus::short_arc : RotationStatus::alike;
  }
  return status;
}

void reject_weak_pivots(PivotFixes& fixes, const std::vector<PivotArc>& arcs) {
  std::vector<std::size_t> new_index(fixes.num_pivots);
  PivotFixes kept;
  kept.num_pivots = 0;
  for (std::size_t pivot = 0; pivot < fixes.num_pivots; ++pivot) {
    new_index[pivot] = kept.num_pivots;
    if (determines(arcs[pivot])) ++kept.num_pivots;
  }
  for (std::size_t i = 0; i < fixes.fixes.size(); ++i) {
    RotationFix fix = fixes.fixes[i];
    if (!determines(arcs[fix.pivot])) continue;
    fix.pivot = new_index[fix.pivot];
    kept.frames.push_back(fixes.frames[i]);
    kept.fixes.push_back(fix);
  }
  fixes = std::move(kept);
}

double compute_median_height(const PivotFixes& fixes, std::size_t pivot) {
  std::vector<double> heights_m;
  for (const RotationFix& fix : fixes.fixes) {
    if (fix.pivot == pivot) heights_m.push_back(fix.height_m);
  }
  return upper_median(heights_m);
}

}  // namespace vlp
