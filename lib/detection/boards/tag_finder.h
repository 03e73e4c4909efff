// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Detector of all tags of a board's family in an image of 8 bits. Corners are in libapriltag's
/// order; pixel centers have integer coordinates. Safe to share between threads.
class TagFinder {
 public:
  virtual ~TagFinder() = default;
  virtual std::vector<TagDetection> detect_tags(const cv::Mat1b& image) const = 0;
};

/// Creates a detector (libapriltag) of the tags of the board's family, for tags surrounded by
/// white. Corners are accurate to 0.05 px.
/// @throws std::invalid_argument if libapriltag does not have the family
std::unique_ptr<TagFinder> make_apriltag_finder(const Board& board);

/// Creates a detector by OpenCV's ArUco module, for tags whose corners touch black squares and for
/// the markers of ChArUco boards. Corners are accurate to 1 to 2 px.
/// @throws std::invalid_argument if OpenCV does not have the family or dictionary
std::unique_ptr<TagFinder> make_aruco_detector(const Board& board);

/// Marker of one of OpenCV's dictionaries as printed by its ArUco module, without the black border.
struct ArucoMarker {
  /// Number of bits along an edge of the marker, without the border.
  int width;
  /// Bits row by row from the top left; true is white.
  std::vector<bool> white;
};

/// Returns the marker `id` of a dictionary, named as in Board::family of a ChArUco board.
/// @throws std::invalid_argument if there is no such dictionary, or no such id in it
ArucoMarker make_aruco_marker(const std::string& dictionary, int id);

}  // namespace vlp
