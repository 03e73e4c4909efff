// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "body_fix.h"
#include "fix.h"
#include "robust_fix.h"

namespace vlp {

/// The lamps of one frame, or of some that follow one another, in room of a fixed size so that
/// nothing is allocated.
struct BodyFrame {
  std::array<BodySighting, kMaxSightings> sightings;
  std::array<int, kMaxSightings> ids;
  /// Distance on the floor plan from each lamp to the nearest other lamp of the map.
  std::array<double, kMaxSightings> nearest_m;
  std::size_t size = 0;
  /// The first so many are of the frame whose fix it is; others were seen earlier.
  std::size_t now = 0;
  /// Whether every sigma_px is one that a detector stated.
  bool noise_is_stated = true;
  int rejected_lamps = 0;
  std::array<int, kMaxSightings> rejected_ids = {};

  std::span<const BodySighting> span() const { return {sightings.data(), size}; }
};

struct BodySolution {
  FixStatus status;
  BodyFix fix;
};

/// The fix of a body that drives, turns or leans, from a frame of two lamps or more whose
/// identities may be wrong. Where the lean is known to 0.15 rad it starts from the fix of a level
/// camera (initial_pose), and otherwise from the poses of the three lamps that are widest apart
/// (three_lamp_poses). Bodies are below their lamps. What fix_robustly() does for cameras that
/// stand level it does here: lamps that are as far from where the fix sees them as fix_robustly()
/// says, there in z, here in metres across their rays; a map that is mirrored; a majority that
/// agrees; noise that does not explain the residuals, though a single lamp less does, and no other.
/// And:
///   undetermined  lamps and priors leave the position uncertain by more than a quarter of the
///                 distance to the lamps: two lamps, or three on one line, and a lean that is free;
///   ambiguous     another solution explains the frame nearly as well (exp(-6) as likely or more);
///   inconsistent  velocity, yaw rate or lean are five standard deviations from what is known.
BodySolution fix_body_frame(BodyFrame& frame, const Eigen::Vector3d& arm_in_body_m,
                            const BodyPrior& prior, double max_residual_share);

}  // namespace vlp
