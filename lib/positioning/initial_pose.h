// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"
#include "sighting.h"

namespace vlp {

/// Computes position and yaw from two or more lamps at one height, in closed form. The
/// least-squares similarity p = s + c z gives H = |c|, g = arg c (the method of [19] in Chen and
/// Guan). All lamps have equal weights. Returns std::nullopt if the lamps coincide in the image.
/// @pre the lamps have equal heights; their mean is used
std::optional<Pose> compute_coplanar_pose(std::span<const Sighting> sightings);

/// A pose in closed form and its status.
struct InitialPose {
  /// `ok`, or the reason of failure.
  FixStatus status;
  Pose pose;
};

/// Computes a pose from two or more lamps in closed form, exact without noise. Two lamps:
/// compute_two_lamp_poses(). Lamps at one height: the similarity. Otherwise the solutions from the
/// two lamps that are far apart in the image; of these, the one that fits the other lamps best.
InitialPose compute_initial_pose(std::span<const Sighting> sightings);

}  // namespace vlp
