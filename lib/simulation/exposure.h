// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "simulation/scene.h"

namespace vlp {

/// What a sensor makes of the mean number of electrons of each pixel (see Sensor): shot noise
/// (Poisson), overflow with bloom, read noise (normal), gain, black level, the colour filters, tone
/// curve and sharpening of a picture, rounding, and the limits of 8 or 16 bits. The result is 8- or
/// 16-bit, and in three colours, blue first, behind colour filters.
/// The same seed gives the same image.
cv::Mat expose(const Sensor& sensor, const cv::Mat1f& mean_electrons, std::uint64_t seed,
               const std::optional<Picture>& picture = {});

}  // namespace vlp
