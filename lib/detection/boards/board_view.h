// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "detection/boards/board_detector.h"

namespace vlp {

/// Detection of a board in an image.
struct BoardView {
  /// File name of the image, without its folder.
  std::string image;
  std::array<int, 2> imager_px;
  BoardDetection seen;
};

}  // namespace vlp
