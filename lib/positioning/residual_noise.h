// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "fix.h"

namespace vlp {

/// The standard deviation of a pixel per axis that the residuals of many fixes show, from
/// detections that state no sigma (so it is one of the undistorted image): sqrt(sum of squared
/// residuals / sum of Fix::redundancy) over the fixes of three lamps or more. A tilt or a lamp map
/// that is wrong counts as noise. Within kMinSigma_px and kMaxSigma_px; nothing when there is no
/// such fix.
std::optional<double> residual_noise_px(std::span<const Fix> fixes);

}  // namespace vlp
