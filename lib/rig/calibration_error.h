// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration.h"

/// A calibration with an error added to one of its parts, in the units in which covariances and
/// what a step passes on state it: intrinsics, and normalized points (x/z, y/z).
namespace vlp {

/// How many of the intrinsics have errors that a calibration states, and steps pass on: all; of a
/// splined lens, whose control points are known each from a few corners, fx, fy, cx, cy, which
/// stand for the whole. What its control points lack is in IntrinsicsReport::uncertainty_px alone.
Eigen::Index stated_intrinsics(const Camera& camera);

/// The zenith's normalized point.
Eigen::Vector2d zenith_point(const RotationCenter& center);

/// With errors added to the stated_intrinsics(); the zenith stays, and center_px with it. A lever
/// arm moves as it does with them, but for what goes with the zenith.
Calibration with_lens_error(Calibration calibration, const Eigen::VectorXd& error);

/// With an error added to the zenith's normalized point, and what goes with it to the lever arm.
/// Precondition: there is a rotation centre.
Calibration with_zenith_error(Calibration calibration, const Eigen::Vector2d& error);

/// With an error added to offset_px / f. Precondition: there is a dispersion.
Calibration with_offset_error(Calibration calibration, const Eigen::Vector2d& error);

/// Computes the covariance of offset_px from captures and lamp map, in px^2, with lens and zenith
/// taken as exact. Returns std::nullopt without Dispersion::covariance.
std::optional<Matrix2> offset_covariance_with_map(const Dispersion& dispersion,
                                                  const Eigen::Vector2d& focal_px);

}  // namespace vlp
