// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>

#include "lamps/signal/stripes.h"

namespace vlp {

/// Features of a lamp's light (Chen and Guan, section 2.1), in the order of kLampFeatures. None
/// depends on the distance of the lamp: at twice the distance it has half the lines and stripes.
///   log_period_lines  logarithm of the stripe period in lines, 1 / (frequency row_time), so that
///                     its errors are relative ones
///   duty              lit fraction of a period, 0 to 1
///   count_per_line    stripes over the lines that they were counted on; whole stripes are
///                     counted, by halves, so that it is coarser than 1 / period
///   lit_area          lit area over the area of the disc, 0 to 1
using LampFeatures = Eigen::Vector4d;

inline constexpr std::array<std::string_view, 4> kLampFeatures{"log_period_lines", "duty",
                                                               "count_per_line", "lit_area"};

/// Returns the features of stripes. @pre The stripes have a period.
LampFeatures features_of(const Stripes& stripes);

}  // namespace vlp
