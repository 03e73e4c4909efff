// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "../camera/lens.h"
#include "../geometry/frames.h"
#include "../geometry/types.h"
#include "body_frame.h"
#include "row_clock.h"

namespace vlp {

/// Whether more than a pose is to be estimated.
bool is_free(const BodyPrior& prior);
bool may_move(const BodyPrior& prior);

/// What pixels allow a camera that may move and lean, before it takes a fix.
struct BodyLimit {
  /// Of (X, Y, Z, yaw): of one that is known to stand and how it leans; what comes on top because
  /// it may move; and because it may lean.
  Matrix4 noise, motion, lean;
  /// The lamps as it sees them, and the fix that they and the prior make.
  BodyFrame frame;
  BodyFix fix;
};

/// For a camera that stands at `level` with these lamps in view, each pixel known to `noise_px` per
/// axis. The prior's mean is at rest and level. Nothing where there is no fix (fix_body_frame), or
/// the lens does not see a lamp. Precondition: a row clock where the prior lets it move.
std::optional<BodyLimit> body_limit(std::span<const Eigen::Vector3d> lamps_m, const Lens& lens,
                                    const Eigen::Matrix3d& camera_from_level, const Pose& level,
                                    double noise_px, const BodyPrior& prior,
                                    const std::optional<RowClock>& row_clock);

}  // namespace vlp
