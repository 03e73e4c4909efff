// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "../geometry/frames.h"
#include "fix.h"
#include "sighting.h"

namespace vlp {

/// Position and yaw from two or more lamps at one height, in closed form: the similarity
/// p = s + c z of least squares gives H = |c|, g = arg c (the method of [19] in Chen and Guan).
/// All lamps weigh alike. Precondition: the lamps' heights are equal; their mean is used.
/// Nothing when the lamps are seen as one.
std::optional<Pose> fix_coplanar_lamps(std::span<const Sighting> sightings);

struct InitialPose {
  /// `ok`, or why there is none.
  FixStatus status;
  Pose pose;
};

/// A pose of two or more lamps in closed form, exact when they are seen without noise: two lamps
/// alone; the similarity when they hang at one height; otherwise the two that are seen far apart,
/// and of their solutions the one that the other lamps agree with.
InitialPose initial_pose(std::span<const Sighting> sightings);

}  // namespace vlp
