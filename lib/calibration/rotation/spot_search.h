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

/// The fixes of the captures that have one, each with the frame it is of. A spot is what is at one
/// height: where the axis stands may change with the height.
struct SpotFixes {
  std::vector<std::size_t> frames;
  std::vector<TurningFix> fixes;
  std::size_t spots = 1;
};

/// Captures of a spot, and how far they turn.
struct SpotArc {
  std::size_t captures;
  double arc_rad;
};

inline constexpr std::size_t kLeastCaptures = 3;

/// Gives the captures of each height a spot of their own, from low to high. `noise_m` is the
/// standard deviation of a fix's height; see SpotCaptures.
void tell_heights_apart(SpotFixes& fixes, double noise_m);

std::vector<SpotArc> arcs_of(const SpotFixes& fixes);

/// Why none of the spots determines a centre; `ok` when one does.
SpotStatus status_of(const std::vector<SpotArc>& arcs);

/// Takes away spots of too few captures or too small an arc. `arcs` are those of `fixes`.
void drop_weak_spots(SpotFixes& fixes, const std::vector<SpotArc>& arcs);

/// The height in the middle of those of a spot.
double height_of(const SpotFixes& fixes, std::size_t spot);

/// The search for the turning that captures show, see SpotCaptures: fixes of all captures, the
/// linear fit of the turning to them, the zenith that this gives, and again until it stays.
class SpotSearch {
 public:
  /// `noise_px` is that of the detections, where fixes of three lamps or more do not tell it. With
  /// `lever_arm` it looks for one before it knows the heights. `map` has to outlive it.
  SpotSearch(const std::vector<Frame>& frames, const LampMap& map, const Camera& camera,
             double noise_px, bool lever_arm);

  SpotStatus run();

  // After a run that ended well:

  /// How far, typically, the fixes are from where they turn.
  double misfit_m() const { return upper_median(turning_.residuals_m); }
  /// Without lamps and sightings.
  SpotCaptures result() const;
  /// Of each capture in result(), its index in the frames.
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
  double noise_px_;  // of the detections, where the fixes do not tell it
  bool lever_arm_;
  Calibration calibration_;
  std::vector<std::string> left_out_;  // why, for each frame; empty for those that are used
  std::set<std::size_t> strays_;
  std::vector<FixStatus> statuses_;
  SpotFixes fixes_;
  double height_noise_m_ = 0;
  Turning turning_;
};

}  // namespace vlp
