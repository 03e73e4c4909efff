// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration.h"

/// Adds errors to parts of a calibration, for numeric derivatives. The units are those of the
/// covariances: intrinsics, and normalized points (x/z, y/z).
namespace vlp {

/// Returns the number of intrinsics, counted from fx, whose errors later steps propagate. It is the
/// number of all intrinsics, but 4 (fx, fy, cx, cy) for splined lenses, since few corners determine
/// each control point. Errors of the control points are only included in
/// IntrinsicsReport::expected_max_error_px.
Eigen::Index count_intrinsics_with_covariance(const Camera& camera);

/// Returns the normalized point (x/z, y/z) of the zenith in the camera frame.
Eigen::Vector2d compute_normalized_zenith_point(const RotationCenter& center);

/// Returns the calibration with `error` added to its first count_intrinsics_with_covariance()
/// intrinsics. The zenith does not change; center_px is updated. The lever arm changes by its
/// derivative with respect to the intrinsics, without the part through the zenith.
Calibration add_error_to_calibrated_intrinsics(Calibration calibration,
                                               const Eigen::VectorXd& error);

/// Returns the calibration with `error` added to the zenith's normalized point (x/z, y/z).
/// center_px and the correlated lever arm are updated.
/// @pre there is a rotation center
Calibration add_error_to_calibrated_zenith(Calibration calibration, const Eigen::Vector2d& error);

/// Returns the calibration with `error` added to offset_px / f, the dispersion offset in focal
/// lengths.
/// @pre there is a dispersion
Calibration add_error_to_calibrated_dispersion_offset(Calibration calibration,
                                                      const Eigen::Vector2d& error);

/// Computes the covariance of offset_px from captures and lamp map, in px^2, with lens and zenith
/// taken as exact. Returns std::nullopt without Dispersion::covariance.
std::optional<Matrix2> compute_dispersion_offset_covariance_with_map_errors(
    const Dispersion& dispersion, const Eigen::Vector2d& focal_px);

}  // namespace vlp
