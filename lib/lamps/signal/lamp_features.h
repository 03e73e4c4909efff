// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>

#include "lamps/signal/stripes.h"

namespace vlp {

/// Features of a lamp's light (Chen and Guan, section 2.1), in the order of kLampFeatures. No
/// feature depends on the distance of the lamp: at twice the distance it has half the scanlines and
/// stripes.
///
/// - log_period_lines: logarithm of the stripe period in scanlines, 1 / (frequency row_time), so
///   that its errors are relative
/// - duty: lit fraction of a period, 0 to 1
/// - count_per_line: number of stripes per scanline; stripes are counted in steps of a half, so
///   that it is coarser than 1 / period
/// - lit_area: fraction of the disc's area that is lit, 0 to 1
using LampFeatures = Eigen::Vector4d;

/// Names of the features.
inline constexpr std::array<std::string_view, 4> kLampFeatures{"log_period_lines", "duty",
                                                               "count_per_line", "lit_area"};

/// Returns the features of a light's stripes. @pre The stripes have a period.
LampFeatures compute_lamp_features(const Stripes& stripes);

}  // namespace vlp
