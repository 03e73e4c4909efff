// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "simulation/scene.h"

namespace vlp {

/// Simulates a sensor (see Sensor) from the mean number of electrons of each pixel.
///
/// Steps: color filters, shot noise (Poisson), overflow with bloom, read noise (normal), gain,
/// black level, demosaicing, tone curve and sharpening of a picture, rounding, limits of 8 or 16
/// bits. The result has 8 or 16 bits; behind color filters it has three colors, blue first. The
/// same seed yields the same image.
cv::Mat expose(const Sensor& sensor, const cv::Mat1f& mean_electrons, std::uint64_t seed,
               const std::optional<ImageProcessing>& picture = {});

}  // namespace vlp
