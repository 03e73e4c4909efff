// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/board_pattern.h"

#include <stdexcept>

#include "detection/boards/aruco_marker.h"
#include "rig/board_layout.h"
#include "simulation/tag_pattern.h"

namespace vlp {
namespace {

void add_corner_squares(const Board& board, std::vector<PrintedRectangle>& all) {
  const double gap_m = board.tag_size_m * board.tag_spacing;
  for (int row = 0; row <= board.rows; ++row) {
    for (int col = 0; col <= board.cols; ++col) {
      const double right_m = col * compute_tag_pitch_m(board),
                   bottom_m = row * compute_tag_pitch_m(board);
      all.push_back({right_m - gap_m, bottom_m - gap_m, right_m, bottom_m, false});
    }
  }
}

void add_squares(const Board& board, std::vector<PrintedRectangle>& all) {
  const double size_m = board.square_size_m;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      if (!is_black(board, col, row)) continue;
      const double left_m = (col - 1) * size_m, top_m = (row - 1) * size_m;
      all.push_back({left_m, top_m, left_m + size_m, top_m + size_m, false});
    }
  }
}

TagPattern make_bits(const Board& board, int id) {
  if (!board.has_squares()) return make_tag_pattern(board.family, id, board.border_bits);
  const ArucoMarker marker = make_aruco_marker(board.family, id);
  TagPattern pattern{marker.width + 2, 0, {}};
  pattern.white.assign(pattern.index(0, pattern.width()), false);
  for (int row = 0; row < marker.width; ++row) {
    for (int col = 0; col < marker.width; ++col) {
      pattern.white[pattern.index(col + 1, row + 1)] =
          marker.white[static_cast<std::size_t>(row * marker.width + col)];
    }
  }
  return pattern;
}

void add_tag(const Board& board, const BoardTag& tag, std::vector<PrintedRectangle>& all) {
  const TagPattern pattern = make_bits(board, tag.id);
  const double bit_m = board.tag_size_m / pattern.border_width;
  if (2 * pattern.outside * bit_m > board.tag_size_m * board.tag_spacing) {
    throw std::invalid_argument("the gap between the tags is too small for " + board.family);
  }
  const Eigen::Vector2d corner_m =
      tag.corners_m[3] - Eigen::Vector2d::Constant(pattern.outside * bit_m);
  for (int row = 0; row < pattern.width(); ++row) {
    for (int col = 0; col < pattern.width(); ++col) {
      const double left_m = corner_m.x() + col * bit_m, top_m = corner_m.y() + row * bit_m;
      all.push_back(
          {left_m, top_m, left_m + bit_m, top_m + bit_m, pattern.white[pattern.index(col, row)]});
    }
  }
}

}  // namespace

std::vector<PrintedRectangle> make_board_pattern(const Board& board) {
  std::vector<PrintedRectangle> all;
  if (board.has_squares()) add_squares(board, all);
  if (board.corner_squares) add_corner_squares(board, all);
  for (const BoardTag& tag : list_board_tags(board)) add_tag(board, tag, all);
  return all;
}

double printed_border_m(const Board& board) {
  if (board.has_squares()) return board.square_size_m;
  return board.corner_squares ? board.tag_size_m * board.tag_spacing : 0;
}

}  // namespace vlp
