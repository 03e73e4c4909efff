// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "frontend/observation.h"

namespace vlp {

/// Returns the observation of an image that shows a board.
inline Observation observed(BoardView view) {
  Observation image{view.image};
  image.size_px = view.imager_px;
  image.board = std::move(view);
  return image;
}

}  // namespace vlp
