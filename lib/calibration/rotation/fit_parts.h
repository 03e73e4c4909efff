// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calibration/rotation/robust_fit.h"
#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot_captures.h"

namespace vlp {

/// The rotation centre whose axis is seen at a normalized point, with the covariance of that.
RotationCenter rotation_center_at(const Eigen::Vector2d& z, RotationModel model,
                                  const Camera& camera, const std::optional<Matrix2>& covariance);

std::vector<double> yaws_of(const SpotCaptures& spot);

std::vector<const double*> pointers_to(const std::vector<double>& values);

/// Fills in residual_px, outliers and used_sightings of a fit whose residuals are the sightings in
/// their order.
void describe(RotationFit& result, const RobustFit& fit, const SpotCaptures& spot);

}  // namespace vlp
