// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "fix.h"
#include "sighting.h"

namespace vlp {

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
