// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>

#include "lamps/signal/stripes.h"

namespace vlp {

/// What tells lamps apart (Chen and Guan, section 2.1), in the order of kLampFeatures. None depends
/// on how far the lamp is: a lamp twice as far has half the lines and half the stripes.
///   log_period_lines  logarithm of the stripe period in lines, 1 / (frequency row_time): errors of
///                     it are shares of the period, for slow and fast lamps alike
///   duty              lit share of a period, 0 to 1
///   count_per_line    stripes over the lines that they were counted on; whole stripes are
///                     counted, by halves, so that it is coarser than 1 / period
///   lit_area          lit area over the area of the disc, 0 to 1
using LampFeatures = Eigen::Vector4d;

inline constexpr std::array<std::string_view, 4> kLampFeatures{"log_period_lines", "duty",
                                                               "count_per_line", "lit_area"};

/// `stripes` has a period: the light flickers.
LampFeatures features_of(const Stripes& stripes);

}  // namespace vlp
