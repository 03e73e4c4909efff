// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration.h"

/// A calibration with an error added to one of its parts, in the units in which covariances and
/// what a step passes on state it: intrinsics, and normalized points (x/z, y/z). And how large the
/// errors are of a part that passes on those of the parts before it.
namespace vlp {

/// fx, fy.
Eigen::Vector2d focal_px_of(const Camera& camera);

/// The zenith's normalized point.
Eigen::Vector2d zenith_point(const RotationCenter& center);

/// With errors added to the intrinsics; the zenith stays, and center_px with it.
Calibration with_lens_error(Calibration calibration, const Eigen::VectorXd& error);

/// With an error added to the zenith's normalized point. Precondition: there is a rotation centre.
Calibration with_zenith_error(Calibration calibration, const Eigen::Vector2d& error);

/// With an error added to offset_px / f. Precondition: there is a dispersion.
Calibration with_offset_error(Calibration calibration, const Eigen::Vector2d& error);

/// Of the error of the zenith's normalized point, from the captures and from the lens. Nothing
/// where the lens states a covariance and it is not known how the zenith moves with it.
/// Precondition: there is a rotation centre.
std::optional<Matrix2> whole_zenith_covariance(const Calibration& calibration);

/// Of the error of the dispersion's offset in pixels, from its captures, from the zenith and from
/// the lens, which moves both. Nothing as above. Precondition: there is a dispersion.
std::optional<Matrix2> whole_offset_covariance(const Calibration& calibration);

}  // namespace vlp
