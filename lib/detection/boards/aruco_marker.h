// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// Marker of one of OpenCV's dictionaries as printed by its ArUco module, without the black border.
struct ArucoMarker {
  /// Number of bits along an edge.
  int width;
  /// Bits row by row from the top left; true is white.
  std::vector<bool> white;
};

/// Returns the marker `id` of a dictionary, named as in Board::family of a ChArUco board.
/// @throws std::invalid_argument if there is no such dictionary, or no such id in it
ArucoMarker make_aruco_marker(const std::string& dictionary, int id);

}  // namespace vlp
