// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_captures.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <set>
#include <utility>

#include "calibration/rotation/rotation_model.h"
#include "camera/lens.h"
#include "geometry/median.h"
#include "positioning/positioner.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Smallest number of captures of a pivot.
constexpr std::size_t kMinCaptures = 3;

RotationStatus select_status(const std::vector<Frame>& frames, const LampMap& map) {
  std::set<int> known, seen;
  for (const Lamp& lamp : map.lamps) known.insert(lamp.id);
  std::size_t captures = 0;
  for (const Frame& frame : frames) {
    if (!frame.detections.empty()) ++captures;
    for (const Detection& detection : frame.detections) {
      if (known.contains(detection.lamp)) seen.insert(detection.lamp);
    }
  }
  if (seen.empty()) return RotationStatus::other_map;
  if (captures < kMinCaptures) return RotationStatus::too_few_captures;
  return seen.size() < 2 ? RotationStatus::too_few_lamps : RotationStatus::ok;
}

/// Returns the reason why there are too few fixes.
RotationStatus select_status(const std::vector<FixStatus>& statuses) {
  const auto count = [&](FixStatus status) {
    return std::count(statuses.begin(), statuses.end(), status);
  };
  const auto few = count(FixStatus::too_few_lamps);
  const auto contradicting = count(FixStatus::inconsistent) + count(FixStatus::mirrored_map) +
                             count(FixStatus::degenerate) + count(FixStatus::lamp_below_camera);
  if (contradicting > few) return RotationStatus::other_map;
  return few > 0 ? RotationStatus::too_few_lamps : RotationStatus::too_few_captures;
}

double compute_mean_height(const LampMap& map) {
  double sum = 0;
  for (const Lamp& lamp : map.lamps) sum += lamp.position_m.z();
  return sum / static_cast<double>(map.lamps.size());
}

/// Position fixes of the captures that have one, with the index of their frame. A pivot is the set
/// of fixes at one height; each height may have another axis.
struct PivotFixes {
  std::vector<std::size_t> frames;
  std::vector<RotationFix> fixes;
  std::size_t num_pivots = 1;
};

/// Number of captures of a pivot and the angular range of their yaws.
struct PivotArc {
  std::size_t captures;
  double arc_rad;

  bool determines_center() const { return captures >= kMinCaptures && arc_rad >= kMinArc_rad; }
};

/// Assigns the fixes to pivots by their height, from the lowest height of the camera up. See
/// RotationCaptures for the criterion.
///
/// @param noise_m  standard deviation of the height of a fix
void cluster_fixes(PivotFixes& fixes, double noise_m) {
  constexpr double clear_sigmas = 3;
  std::vector<std::size_t> order(fixes.fixes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, std::greater(), [&](std::size_t i) { return fixes.fixes[i].height_m; });
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

/// Counts the captures of each pivot and computes their angular ranges.
std::vector<PivotArc> list_pivot_arcs(const PivotFixes& fixes) {
  std::vector<std::vector<double>> yaws_rad(fixes.num_pivots);
  for (const RotationFix& fix : fixes.fixes) yaws_rad[fix.pivot].push_back(fix.pose.yaw_rad);
  std::vector<PivotArc> arcs;
  arcs.reserve(fixes.num_pivots);
  for (const auto& yaws : yaws_rad) arcs.push_back({yaws.size(), measure_arc(yaws)});
  return arcs;
}

/// Returns `ok` if at least one pivot determines a center, otherwise the reason why none does.
RotationStatus select_status(const std::vector<PivotArc>& arcs) {
  constexpr double max_equal_yaw_rad = 0.05;
  RotationStatus status = RotationStatus::too_few_captures;
  bool has_rotation = false;
  for (const PivotArc& pivot : arcs) {
    if (pivot.determines_center()) return RotationStatus::ok;
    if (pivot.captures < kMinCaptures) continue;
    has_rotation = has_rotation || pivot.arc_rad > max_equal_yaw_rad;
    status = has_rotation ? RotationStatus::short_arc : RotationStatus::single_yaw;
  }
  return status;
}

/// Removes pivots with too few captures or too small an angular range. `arcs` is
/// list_pivot_arcs(fixes).
void reject_short_arcs(PivotFixes& fixes, const std::vector<PivotArc>& arcs) {
  std::vector<std::size_t> new_index(fixes.num_pivots);
  PivotFixes kept;
  kept.num_pivots = 0;
  for (std::size_t pivot = 0; pivot < fixes.num_pivots; ++pivot) {
    new_index[pivot] = kept.num_pivots;
    if (arcs[pivot].determines_center()) ++kept.num_pivots;
  }
  for (std::size_t i = 0; i < fixes.fixes.size(); ++i) {
    RotationFix fix = fixes.fixes[i];
    if (!arcs[fix.pivot].determines_center()) continue;
    fix.pivot = new_index[fix.pivot];
    kept.frames.push_back(fixes.frames[i]);
    kept.fixes.push_back(fix);
  }
  fixes = std::move(kept);
}

/// Returns the upper median of the heights of a pivot, as in RotationFix::height_m.
double compute_pivot_height(const PivotFixes& fixes, std::size_t pivot) {
  std::vector<double> heights_m;
  for (const RotationFix& fix : fixes.fixes) {
    if (fix.pivot == pivot) heights_m.push_back(fix.height_m);
  }
  return upper_median(heights_m);
}

/// Iterative search for the rotation in place; see RotationCaptures. Each iteration locates all
/// captures, fits the rotation model to the fixes, and updates the zenith, until the remaining tilt
/// is below 1e-10 rad.
class RotationSearch {
 public:
  /// @param noise_px   noise of the detections; used if no fix has three lamps or more
  /// @param lever_arm  whether the first iterations estimate a lever arm, before the heights are
  ///     known
  /// @pre `map` outlives this object
  RotationSearch(const std::vector<Frame>& frames, const LampMap& map, const Camera& camera,
                 double noise_px, bool lever_arm)
      : frames_(frames),
        map_(map),
        lamps_z_m_(compute_mean_height(map)),
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

  /// Runs the search. The results are valid if it returns `ok`.
  RotationStatus search_pivots() {
    constexpr int num_rough_iterations = 4, max_iterations = 40;
    for (int iteration = 0;
         iteration < max_iterations && !(iteration > num_rough_iterations && has_converged());
         ++iteration) {
      // The tolerance is larger while the tilt is not corrected, because lamps contradict each
      // other then.
      locate(iteration < num_rough_iterations ? 0.3 : PositionerOptions().max_residual_fraction);
      if (fixes_.fixes.size() < kMinCaptures) return select_status(statuses_);
      if (iteration >= num_rough_iterations) cluster_fixes(fixes_, height_noise_m_);
      const bool estimates_arm = iteration < num_rough_iterations && lever_arm_;
      if (const RotationStatus status = fit_rotation(estimates_arm); status != RotationStatus::ok)
        return status;
    }
    if (median_residual_m() > 0.05 * compute_pivot_height(fixes_, 0))
      return RotationStatus::axis_moved;
    reject_fix_outliers();
    locate(PositionerOptions().max_residual_fraction);
    cluster_fixes(fixes_, height_noise_m_);
    return fit_rotation(false);
  }

  /// Returns the upper median of the distances of the fixes from their predicted positions, in m.
  double median_residual_m() const { return upper_median(model_fit_.residuals_m); }
  /// Returns the frame index of each capture in make_captures().
  const std::vector<std::size_t>& frame_indices() const { return fixes_.frames; }
  /// Returns the captures without `lamps`, `observations` and `median_sigma_px`.
  RotationCaptures make_captures() const {
    RotationCaptures pivot;
    pivot.zenith_in_camera = calibration_.rotation_center->zenith_in_camera;
    pivot.lever_arm_m = model_fit_.lever_arm_m;
    const auto arcs = list_pivot_arcs(fixes_);
    for (std::size_t i = 0; i < fixes_.num_pivots; ++i) {
      pivot.heights.push_back({lamps_z_m_ - compute_pivot_height(fixes_, i), model_fit_.axes_m[i],
                               arcs[i].arc_rad, static_cast<int>(arcs[i].captures)});
    }
    for (std::size_t i = 0; i < fixes_.fixes.size(); ++i) {
      const RotationFix& fix = fixes_.fixes[i];
      pivot.captures.push_back({frames_[fixes_.frames[i]].image, fix.pivot, fix.pose.yaw_rad});
    }
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (!rejection_reasons_[i].empty())
        pivot.rejected_captures.push_back({frames_[i].image, rejection_reasons_[i]});
    }
    return pivot;
  }

 private:
  Eigen::Vector3d& current_zenith() { return calibration_.rotation_center->zenith_in_camera; }

  void locate(double max_residual_fraction) {
    PositionerOptions options;
    options.max_residual_fraction = max_residual_fraction;
    const Positioner positioner(map_, calibration_, options);
    fixes_ = {};
    statuses_.clear();
    std::vector<Fix> found;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (outliers_.contains(i)) continue;
      const Fix fix = positioner.compute_position_fix(frames_[i].detections);
      statuses_.push_back(fix.status);
      rejection_reasons_[i] = fix.has_succeeded() ? "" : describe_fix_status(fix.status);
      if (!fix.has_succeeded()) continue;
      const Pose& pose = fix.state.pose;
      fixes_.frames.push_back(i);
      fixes_.fixes.push_back({pose, lamps_z_m_ - pose.position_m.z(), 0});
      found.push_back(fix);
    }
    height_noise_m_ = estimate_height_noise_m(found);
  }

  /// Estimates the standard deviation of the height of a fix from the residuals, which include the
  /// tilt that is not corrected yet.
  double estimate_height_noise_m(const std::vector<Fix>& fixes) const {
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

  RotationStatus fit_rotation(bool lever_arm) {
    const auto arcs = list_pivot_arcs(fixes_);
    if (const RotationStatus status = select_status(arcs); status != RotationStatus::ok)
      return status;
    for (const std::size_t i : fixes_.frames)
      rejection_reasons_[i] = "too few captures, or too small an arc, at its height";
    reject_short_arcs(fixes_, arcs);
    for (const std::size_t i : fixes_.frames) rejection_reasons_[i].clear();
    model_fit_ =
        fit_rotation_model(fixes_.fixes, fixes_.num_pivots, lever_arm || fixes_.num_pivots > 1);
    const Eigen::Vector3d up(-model_fit_.delta.x(), -model_fit_.delta.y(), 1);
    current_zenith() = (level_rotation_from_zenith(current_zenith()).transpose() * up).normalized();
    // Three captures and a lever arm have no redundancy: noise can move the zenith anywhere.
    return current_zenith().z() > 0 ? RotationStatus::ok : RotationStatus::axis_moved;
  }

  bool has_converged() const {
    constexpr double tolerance_rad = 1e-10;
    return model_fit_.delta.norm() < tolerance_rad;
  }

  void reject_fix_outliers() {
    const double max_residual_m =
        std::max(8 * median_residual_m(), 0.01 * compute_pivot_height(fixes_, 0));
    for (std::size_t i = 0; i < fixes_.fixes.size(); ++i) {
      if (!(model_fit_.residuals_m[i] > max_residual_m)) continue;
      outliers_.insert(fixes_.frames[i]);
      rejection_reasons_[fixes_.frames[i]] = "its fix is not on the rotation axis of the others";
    }
  }

  std::vector<Frame> frames_;
  const LampMap& map_;
  double lamps_z_m_;
  double noise_px_;
  bool lever_arm_;
  Calibration calibration_;
  std::vector<std::string> rejection_reasons_;  // reason for each frame; empty if it is used
  std::set<std::size_t> outliers_;
  std::vector<FixStatus> statuses_;
  PivotFixes fixes_;
  double height_noise_m_ = 0;
  RotationModelFit model_fit_;
};

void add_observations(RotationCaptures& rotation, const Frame& frame, std::size_t capture,
                      const Lens& lens) {
  for (const Detection& detection : frame.detections) {
    const Lamp* lamp = find_lamp_by_id(rotation.lamps, detection.lamp);
    const auto ray = lens.unproject_pixel(detection.pixel);
    if (lamp == nullptr || !ray) continue;
    const Eigen::Vector3d unit = ray->direction.normalized();
    if (!lens.project_point(unit)) continue;
    rotation.observations.push_back({capture,
                                     static_cast<std::size_t>(lamp - rotation.lamps.data()),
                                     detection.pixel, detection.sigma_px, unit});
  }
}

std::optional<double> median_sigma_px(const std::vector<Frame>& frames) {
  std::vector<double> given_px;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      if (!detection.sigma_px) return std::nullopt;
      given_px.push_back(*detection.sigma_px);
    }
  }
  return upper_median(given_px);
}

}  // namespace

RotationCaptures detect_pivots(const std::vector<Frame>& frames, const LampMap& map,
                               const Camera& camera) {
  RotationCaptures rotation;
  rotation.status = select_status(frames, map);
  if (rotation.status != RotationStatus::ok) return rotation;
  const auto given_px = median_sigma_px(frames);
  const double noise_px = given_px.value_or(1);
  // A long lever arm that is mistaken for a tilt can hide a second height. Estimated at one height,
  // a lever arm can hide the tilt.
  RotationSearch without_arm(frames, map, camera, noise_px, false),
      with_arm(frames, map, camera, noise_px, true);
  rotation.status = without_arm.search_pivots();
  const bool both_succeeded = with_arm.search_pivots() == RotationStatus::ok;
  const bool arm_is_better = both_succeeded && (rotation.status != RotationStatus::ok ||
                                                with_arm.median_residual_m() <
                                                    0.5 * without_arm.median_residual_m() - 1e-9);
  if (arm_is_better) rotation.status = RotationStatus::ok;
  if (rotation.status != RotationStatus::ok) return rotation;
  const RotationSearch& search = arm_is_better ? with_arm : without_arm;
  rotation = search.make_captures();
  rotation.median_sigma_px = given_px;
  std::set<int> seen;
  for (const std::size_t i : search.frame_indices()) {
    for (const Detection& detection : frames[i].detections) seen.insert(detection.lamp);
  }
  for (const Lamp& lamp : map.lamps) {
    if (seen.contains(lamp.id)) rotation.lamps.push_back(lamp);
  }
  const Lens lens(camera.lens_model, camera.intrinsics);
  for (std::size_t i = 0; i < search.frame_indices().size(); ++i) {
    add_observations(rotation, frames[search.frame_indices()[i]], i, lens);
  }
  return rotation;
}

std::string_view describe_status(RotationStatus status) {
  switch (status) {
    case RotationStatus::ok:
      return "captures of a rotation in place";
    case RotationStatus::other_map:
      return "the visible lamps contradict the lamp map: is it the map of this room?";
    case RotationStatus::too_few_lamps:
      return "each capture needs two lamps or more: add lamps, or move to where more are visible";
    case RotationStatus::too_few_captures:
      return "each height needs three captures or more: add captures of a rotation in place, "
             "preferably twelve over a full turn";
    case RotationStatus::single_yaw:
      return "the captures have the same yaw: turn the camera in place between captures";
    case RotationStatus::short_arc:
      return "the captures span less than 90 degrees: add captures over more of the turn, "
             "preferably a full one";
    case RotationStatus::axis_moved:
      return "the captures are not of one rotation in place: take them while rotating about one "
             "vertical axis, without driving";
  }
  return "";
}

}  // namespace vlp
