// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calibration/rotation/robust_fit.h"
#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot_captures.h"

namespace vlp {

/// Returns the rotation center whose axis appears at normalized point z in the camera. `covariance`
/// is the covariance of z.
RotationCenter rotation_center_at(const Eigen::Vector2d& z, RotationModel model,
                                  const Camera& camera, const std::optional<Matrix2>& covariance);

/// Returns the yaws of the captures, rad, in the order of SpotCaptures::captures.
std::vector<double> yaws_of(const SpotCaptures& spot);

/// Returns a pointer to each element of `values`.
std::vector<const double*> pointers_to(const std::vector<double>& values);

/// Sets residual_px, outliers and used_sightings of `result` from a fit.
/// @pre the residual blocks of `fit` are the observations of `spot`, in the same order
void describe(RotationFit& result, const RobustFit& fit, const SpotCaptures& spot);

}  // namespace vlp
