// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "calibration/rotation/spot_captures.h"
#include "calibration/rotation/spot_fixes.h"
#include "geometry/median.h"
#include "positioning/fix.h"

namespace vlp {

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
