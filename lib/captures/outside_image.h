// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "captures/detections_table.h"

namespace vlp {

/// How many detections are far outside an image of this width and height: by more than a tenth of
/// it. A lamp that the image's edge cuts may have its centre a little outside.
std::size_t count_far_outside(std::span<const Frame> frames, const std::array<int, 2>& imager_px);

}  // namespace vlp
