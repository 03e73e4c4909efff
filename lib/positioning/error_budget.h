// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "../camera/lens.h"
#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "body_fix.h"
#include "row_clock.h"

namespace vlp {

/// What makes a fix wrong: standard deviations, each of an error that is normal and independent of
/// the others.
struct ErrorSources {
  /// Of each lamp's pixel, per axis. Positive.
  double noise_px;
  /// Of the image centre, per axis; common to all lamps.
  double center_px;
  /// Of the camera's tilt, about each of the level frame's x and y axes; common to all lamps.
  double tilt_rad;
  /// Of each lamp's position in the map, per axis.
  double lamp_map_m;
};

/// Covariances of (X, Y, Z, yaw) in metres and radians, one for each source.
struct ErrorBudget {
  /// The theoretical limit (Cramer-Rao; Chen and Guan, section 2.2): what no unbiased method can
  /// better at that pixel noise. For n lamps at one height H above a camera of focal length f
  /// px, with S = sum |P_i - P'|^2 about their centre P' and d = |P' - position|, it is
  ///   sd(X) = sd(Y) = (H/f) noise_px sqrt(1/n + d^2/S),
  ///   sd(yaw) = (H/f) noise_px / sqrt(S),   sd(Z) = H (H/f) noise_px / sqrt(S).
  Matrix4 noise;
  Matrix4 center;
  Matrix4 tilt;
  Matrix4 lamp_map;
  /// What the pixels' noise does on top of `noise` because the camera may move, and then because it
  /// may lean (BodyLimit); zero for one of which both are known.
  Matrix4 motion = Matrix4::Zero(), lean = Matrix4::Zero();

  Matrix4 total() const { return noise + center + tilt + lamp_map + motion + lean; }
};

/// The error budget of a fix at `level`, the pose of a level camera that sees `lamps_m` (positions
/// in the world) and weighs them alike: how each source passes through the least-squares fix, to
/// first order. Nothing for fewer than two lamps, lamps that the lens does not see, or lamps that
/// do not determine a fix.
std::optional<ErrorBudget> error_budget(std::span<const Eigen::Vector3d> lamps_m, const Lens& lens,
                                        const Pose& level, const ErrorSources& sources);

/// The same of one that may move and lean, of which `prior` knows so much; its mean is at rest and
/// level. What lamps and prior do not determine (fix_body_frame) has no budget, either. A tilt that
/// is estimated hardly suffers from an error of the calibrated one. Precondition: a row clock where
/// the prior lets it move.
std::optional<ErrorBudget> error_budget(std::span<const Eigen::Vector3d> lamps_m, const Lens& lens,
                                        const Pose& level, const ErrorSources& sources,
                                        const BodyPrior& prior,
                                        const std::optional<RowClock>& row_clock);

}  // namespace vlp
