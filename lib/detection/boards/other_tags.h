// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "rig/board.h"

namespace vlp {

/// Describes in one line another pattern that an image without tags of `board` shows: a mirrored
/// board, tags of another family or with another border, or markers of another dictionary. Returns
/// an empty string if none of them is detected. Takes about a second per image.
std::string describe_tags_of_other_kinds(const Board& board, const cv::Mat& image);

}  // namespace vlp
