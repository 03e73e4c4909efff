// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "detection/boards/board_detector.h"
#include "detection/boards/tag_families.h"
#include "geometry/homography.h"

namespace vlp {

/// Returns true if the image shows the bits of the tag's id between the corners of `tag`. Bits are
/// sampled at their centers. A bit is white above the mean of the brightest and the darkest sample.
/// Up to two bits may differ. Returns false if a bit lies outside the image.
///
/// @param levels       gray levels of the image
/// @param border_bits  width of the printed border, in bits
bool matches_tag_bits(const TagDetection& tag, const cv::Mat1f& levels,
                      const apriltag_family_t& family, int border_bits);

}  // namespace vlp
