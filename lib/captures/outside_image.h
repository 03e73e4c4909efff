// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "captures/detections_table.h"

namespace vlp {

/// Counts the detections outside the image by more than 10 % of its width or height. The center of
/// a lamp at the image's edge may be slightly outside.
std::size_t count_far_outside(std::span<const Frame> frames, const std::array<int, 2>& imager_px);

}  // namespace vlp
