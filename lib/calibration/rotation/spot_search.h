// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "calibration/rotation/spot_captures.h"
#include "calibration/rotation/turning.h"
#include "geometry/median.h"
#include "positioning/fix.h"

namespace vlp {

/// Position fixes of the captures that have one, with the index of their frame. A spot is the set
/// of fixes at one height; each height may have another axis.
struct SpotFixes {
  std::vector<std::size_t> frames;
  std::vector<TurningFix> fixes;
  std::size_t spots = 1;
};

/// Number of captures of a spot and the angular range of their yaws.
struct SpotArc {
  std::size_t captures;
  double arc_rad;
};

/// Smallest number of captures of a spot.
inline constexpr std::size_t kLeastCaptures = 3;

/// Assigns the fixes to spots by their height, from the lowest height of the camera up. Changes
/// TurningFix::spot and SpotFixes::spots. See SpotCaptures for the criterion.
///
/// @param noise_m  standard deviation of the height of a fix
void tell_heights_apart(SpotFixes& fixes, double noise_m);

/// Counts the captures of each spot and computes their angular ranges.
std::vector<SpotArc> arcs_of(const SpotFixes& fixes);

/// Returns `ok` if at least one spot determines a center, otherwise the reason why none does.
SpotStatus status_of(const std::vector<SpotArc>& arcs);

/// Removes spots with too few captures or too small an angular range. `arcs` is arcs_of(fixes).
void drop_weak_spots(SpotFixes& fixes, const std::vector<SpotArc>& arcs);

/// Returns the upper median of the heights of a spot, as in TurningFix::height_m.
double height_of(const SpotFixes& fixes, std::size_t spot);

/// Iterative search for the rotation in place; see SpotCaptures. Each iteration locates all
/// captures, fits the rotation model to the fixes, and updates the zenith, until the remaining tilt
/// is below 1e-10 rad.
class SpotSearch {
 public:
  /// @param noise_px   noise of the detections; used if no fix has three lamps or more
  /// @param lever_arm  whether the first iterations estimate a lever arm, before the heights are
  ///     known
  /// @pre `map` outlives this object
  SpotSearch(const std::vector<Frame>& frames, const LampMap& map, const Camera& camera,
             double noise_px, bool lever_arm);

  /// Runs the search.
  SpotStatus run();

  // Valid after run() returned `ok`:

  /// Returns the upper median of the distances of the fixes from their predicted positions, in m.
  double misfit_m() const { return upper_median(turning_.residuals_m); }
  /// Returns the captures without `lamps`, `sightings` and `stated_px`.
  SpotCaptures result() const;
  /// Returns the frame index of each capture in result().
  const std::vector<std::size_t>& frames() const { return fixes_.frames; }

 private:
  Eigen::Vector3d& zenith() { return calibration_.rotation_center->zenith_in_camera; }
  void locate(double max_residual_share);
  double height_noise_m(const std::vector<Fix>& fixes) const;
  SpotStatus turn(bool lever_arm);
  bool settled() const;
  void leave_out_strays();

  std::vector<Frame> frames_;
  const LampMap& map_;
  double lamps_z_m_;
  double noise_px_;  // of the detections; used if the fixes have no redundancy
  bool lever_arm_;
  Calibration calibration_;
  std::vector<std::string> left_out_;  // reason for each frame; empty if it is used
  std::set<std::size_t> strays_;
  std::vector<FixStatus> statuses_;
  SpotFixes fixes_;
  double height_noise_m_ = 0;
  Turning turning_;
};

}  // namespace vlp
