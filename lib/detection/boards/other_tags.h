// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "rig/board.h"

namespace vlp {

/// Searches an image with none or few tags of `board` for another pattern: the mirrored board, tags
/// of another family or border width, or markers of another dictionary. Tags of another kind count
/// only if there are more of them than tags of the board. Takes about a second per image.
/// @return the pattern in one line for a message; empty if none is detected, and for chessboards
std::string describe_other_tags(const Board& board, const cv::Mat& image);

}  // namespace vlp
