// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "camera/lens.h"
#include "detection/boards/board_detector.h"

namespace vlp {

/// Comparison of the board in the images with board.yaml.
///
/// The homography of the square of one tag gives the positions of its neighbors in tag widths.
/// Order of ids and spacing can therefore be checked without a lens. The size of a tag cannot: a
/// larger board at a larger distance looks the same.
struct BoardCheck {
  /// Contradiction between board.yaml and the images, as one line of text with the values measured
  /// in the images. Empty if they agree.
  std::string problem;
  /// Median distance of neighboring tags, in tag widths (ChArUco: size of a square in marker
  /// widths). std::nullopt with fewer than ten pairs of tags, or if no pair lies as on the board.
  std::optional<double> pitch;
};

/// Compares the layout and the spacing of a board with the tags in the images.
///
/// @param lens  undistorts the tags, if given; the tolerance of the pitch is then 1 % instead of 5
///     % (ChArUco: always 15 %)
/// @param shift_px  inward displacement of the tag edges (edge_corrections.h), px, clamped to
/// +-1.5 px
BoardCheck check_board_layout(const Board& board, std::span<const BoardView> views,
                              const std::optional<Lens>& lens, double shift_px = 0);

}  // namespace vlp
