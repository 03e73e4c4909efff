// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Finds every tag of a board's family in an image of 8 bits: corners in libapriltag's order, pixel
/// centres at whole numbers. Safe to share between threads.
class TagFinder {
 public:
  virtual ~TagFinder() = default;
  virtual std::vector<SeenTag> find(const cv::Mat1b& image) const = 0;
};

/// By libapriltag: tags with white around them; corners are good to 0.05 px.
std::unique_ptr<TagFinder> apriltag_finder(const Board& board);

/// By OpenCV's ArUco module: also tags that black squares touch; corners are good to 1 or 2 px.
/// Or the markers of a ChArUco board. Throws std::invalid_argument for families and dictionaries
/// that it lacks.
std::unique_ptr<TagFinder> aruco_finder(const Board& board);

}  // namespace vlp
