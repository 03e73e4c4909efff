// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calibration/rotation/robust_fit.h"
#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/rotation_fit.h"

namespace vlp {

/// Returns the rotation center whose axis appears at normalized point z in the camera. `covariance`
/// is the covariance of z.
RotationCenter make_rotation_center(const Eigen::Vector2d& z, RotationModel model,
                                    const Camera& camera, const std::optional<Matrix2>& covariance);

/// Returns the yaws of the captures, rad, in the order of RotationCaptures::captures.
std::vector<double> collect_yaws(const RotationCaptures& rotation);

/// Returns a pointer to each element of `values`.
std::vector<const double*> pointers_to(const std::vector<double>& values);

/// Sets residual_px, outliers and used_observations of `result` from a fit.
/// @pre the residual blocks of `fit` are the observations of `rotation`, in the same order
void set_statistics(RotationFit& result, const RobustFit& fit, const RotationCaptures& rotation);

}  // namespace vlp
