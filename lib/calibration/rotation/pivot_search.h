// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/rotation_model.h"
#include "geometry/median.h"
#include "positioning/fix.h"

namespace vlp {

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
};

/// Smallest number of captures of a pivot.
inline constexpr std::size_t kMinCaptures = 3;

/// Assigns the fixes to pivots by their height, from the lowest height of the camera up. Changes
/// RotationFix::pivot and PivotFixes::num_pivots. See RotationCaptures for the criterion.
///
/// @param noise_m  standard deviation of the height of a fix
void cluster_by_height(PivotFixes& fixes, double noise_m);

/// Counts the captures of each pivot and computes their angular ranges.
std::vector<PivotArc> compute_pivot_arcs(const PivotFixes& fixes);

/// Returns `ok` if at least one pivot determines a center, otherwise the reason why none does.
RotationStatus find_status(const std::vector<PivotArc>& arcs);

/// Removes pivots with too few captures or too small an angular range. `arcs` is
/// compute_pivot_arcs(fixes).
void reject_weak_pivots(PivotFixes& fixes, const std::vector<PivotArc>& arcs);

/// Returns the upper median of the heights of a pivot, as in RotationFix::height_m.
double compute_median_height(const PivotFixes& fixes, std::size_t pivot);

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
                 double noise_px, bool lever_arm);

  /// Runs the search.
  RotationStatus run();

  // Valid after run() returned `ok`:

  /// Returns the upper median of the distances of the fixes from their predicted positions, in m.
  double median_residual_m() const { return upper_median(model_fit_.residuals_m); }
  /// Returns the captures without `lamps`, `sightings` and `median_sigma_px`.
  RotationCaptures result() const;
  /// Returns the frame index of each capture in result().
  const std::vector<std::size_t>& frames() const { return fixes_.frames; }

 private:
  Eigen::Vector3d& zenith() { return calibration_.rotation_center->zenith_in_camera; }
  void locate(double max_residual_share);
  double height_noise_m(const std::vector<Fix>& fixes) const;
  RotationStatus fit_rotation(bool lever_arm);
  bool has_converged() const;
  void reject_outliers();

  std::vector<Frame> frames_;
  const LampMap& map_;
  double lamps_z_m_;
  double noise_px_;  // of the detections; used if the fixes have no redundancy
  bool lever_arm_;
  Calibration calibration_;
  std::vector<std::string> rejection_reasons_;  // reason for each frame; empty if it is used
  std::set<std::size_t> outliers_;
  std::vector<FixStatus> statuses_;
  PivotFixes fixes_;
  double height_noise_m_ = 0;
  RotationModelFit model_fit_;
};

}  // namespace vlp
