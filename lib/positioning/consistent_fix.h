// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "fix.h"
#include "sighting.h"
#include "weighted_fix.h"

namespace vlp {

struct ConsistentFix {
  /// `ok`, or why there is none.
  FixStatus status;
  WeightedFix fix;
};

/// The least-squares fix of two or more lamps from initial_pose(), looked at critically:
///   degenerate    the lamps do not determine it: the height's standard deviation exceeds the
///   height; inconsistent  of three or more, one is farther in z than `max_residual` from where the
///   fix
///                 sees it.
ConsistentFix fix_consistent(std::span<const Sighting> sightings, double max_residual);

/// Root of the mean squared distance of the sightings from their mean, in z.
double spread_of(std::span<const Sighting> sightings);

}  // namespace vlp
