// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// A marker of one of OpenCV's dictionaries, as its ArUco module prints it, without the black
/// border.
struct ArucoMarker {
  /// Bits along an edge.
  int width;
  /// Row by row from the top left; true is white.
  std::vector<bool> white;
};

/// dictionary: as Board::family of a ChArUco board. Throws std::invalid_argument when it has no
/// such id.
ArucoMarker aruco_marker(const std::string& dictionary, int id);

}  // namespace vlp
