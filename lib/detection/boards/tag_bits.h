// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "detection/boards/board_detector.h"
#include "detection/boards/tag_families.h"
#include "geometry/homography.h"

namespace vlp {

/// Whether the image shows, between the corners of `tag`, the bits of the tag with its id: the grey
/// levels at the bits' middles, taken for white above the mean of the brightest and the darkest,
/// differ from them in two at most. border_bits: of the printed tag.
bool shows_its_bits(const SeenTag& tag, const cv::Mat1f& levels, const apriltag_family_t& family,
                    int border_bits);

}  // namespace vlp
