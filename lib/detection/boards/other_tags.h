// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "rig/board.h"

namespace vlp {

/// What an image shows that has no tag of a board: a mirrored board, tags of another family, or
/// with another border, markers of another dictionary. In
/// one line; empty when it is none of these. It takes a second for each image.
std::string other_tags(const Board& board, const cv::Mat& image);

}  // namespace vlp
