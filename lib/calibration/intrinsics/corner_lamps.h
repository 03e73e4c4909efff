// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "captures/detections_table.h"
#include "detection/boards/board_detector.h"
#include "rig/board.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Corners of a board as lamps at known positions, for a position fix of each view.
struct CornerLamps {
  /// Map of all corners as lamps below the camera (LampMap::lamps_below_camera). World: x right, y
  /// up on the board as printed, z towards the viewer, origin at the bottom left corner. Ids: 4 tag
  /// + corner, with corner 0 to 3 as in BoardTag::corners_m; on boards of squares the index of
  /// list_inner_corners_m().
  LampMap map;
  /// Corners of each view; every n-th one if a fix does not take all of them.
  std::vector<Frame> frames;
  /// Numbers of corners: `corners` are in `frames`, `corners_without_sd` of these have no standard
  /// deviation. `left_out` others would exceed Positioner::max_lamps of a view.
  std::size_t corners = 0, corners_without_sd = 0, left_out = 0;
  /// Standard deviation of corners that state none; std::nullopt if it is not given and there are
  /// too few corners to estimate it.
  std::optional<double> sigma_px = {};
};

/// Converts the corners of views of a board to lamps.
///
/// @param sigma_px  standard deviation of corners that state none, per axis; divided by the weight
///     of a point (PointDetection::weight). std::nullopt: estimate_corner_noise_px()
/// @param sd_m  standard deviation of the positions on the board, per axis; std::nullopt: exact
CornerLamps make_corner_lamps(std::span<const BoardView> views, const Board& board,
                              const std::optional<double>& sigma_px,
                              const std::optional<double>& sd_m);

}  // namespace vlp
