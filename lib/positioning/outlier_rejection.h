// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <cstddef>
#include <span>

#include "../geometry/types.h"
#include "body_solution.h"
#include "fix.h"
#include "pose_observations.h"

namespace vlp {

/// Estimates the state of a body from a frame with at least one lamp. The identities of lamps may
/// be wrong.
///
/// A lamp contradicts the fix if its distance from its ray, at its height, exceeds one of two
/// limits:
///   `max_residual_fraction` times the RMS radius of all lamps;
///   0.15 times the smallest distance from a lamp of the frame to its nearest lamp of the map,
///   which excludes confusion of neighbors.
/// On a contradiction, with
///   three or more  that fit the mirror image of the map, the status is `mirrored_map`;
///   four or more   the agreeing majority makes the fix: the largest set that agrees with a state
///                  from two lamps, or from three if roll and pitch are unknown. The others are
///                  rejected;
///   others         the status is `inconsistent`.
/// If residuals below these limits exceed five standard deviations, and the mirror image fits a
/// hundred times better, the status is `mirrored_map`, too.
///
/// Additional statuses: those of estimate_pose_from_all_lamps(), and
///   inconsistent  height, velocity, yaw rate or roll and pitch differ from the prior by more than
///                 five standard deviations
BodySolution estimate_pose_robustly(FrameObservations& frame, const BodyProblem& problem,
                                    double max_residual_fraction);

/// Lamps of a frame that contradict the others, as indices: none, one or several.
using OutlierLamps = std::bitset<kMaxSightings>;

/// Finds the lamps that contradict the others by more than noise and common errors explain. Assumes
/// that the errors of different lamps are independent.
///
/// While chi-squared exceeds its limit, rejects the lamp whose removal reduces chi-squared most, to
/// first order from `fix`. Limit:
///   all errors known  the 1e-4 bound of chi-squared;
///   others            25 times the degrees of freedom: five standard deviations. The result then
///                     has to be unique, to explain the residuals a hundred times better, and to
///                     leave less than 9 times the degrees of freedom: a small error of tilt or map
///                     affects all lamps and rarely has this pattern.
/// Returns none without a majority, or if fewer than two degrees of freedom would remain.
///
/// @param common  covariance of each residual from the common errors, in standard deviations
OutlierLamps flag_outlier_lamps(std::span<const LampObservation> sightings,
                                std::span<const Matrix2> common, const BodyProblem& problem,
                                const BodyFix& fix, bool are_all_errors_known);

/// Rejects the outliers of a frame (flag_outlier_lamps()) and estimates the state again. Keeps
/// frame and solution if the other lamps do not determine a state within the prior.
/// @pre all observations are from the current frame
BodySolution reject_outlier_lamps(FrameObservations& frame, const OutlierLamps& outliers,
                                  const BodyProblem& problem, const BodySolution& all);

}  // namespace vlp
