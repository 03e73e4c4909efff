// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/board_layout.h"

namespace vlp {
namespace {

int id_at(const Board& board, int col, int row) {
  const auto [column_major, from] = board.id_order;
  const bool from_right = from == BoardCorner::bottom_right || from == BoardCorner::top_right;
  const bool from_bottom = from == BoardCorner::bottom_left || from == BoardCorner::bottom_right;
  const int along_cols = from_right ? board.cols - 1 - col : col;
  const int along_rows = from_bottom ? board.rows - 1 - row : row;
  return board.first_id + (column_major ? along_cols * board.rows + along_rows
                                        : along_rows * board.cols + along_cols);
}

}  // namespace

double tag_pitch_m(const Board& board) { return board.tag_size_m * (1 + board.tag_spacing); }

Eigen::Vector2d tag_field_m(const Board& board) {
  return Eigen::Vector2d(board.cols - 1, board.rows - 1) * tag_pitch_m(board) +
         Eigen::Vector2d::Constant(board.tag_size_m);
}

std::vector<BoardTag> board_layout(const Board& board) {
  std::vector<BoardTag> tags;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      const double left = col * tag_pitch_m(board), right = left + board.tag_size_m;
      const double top = row * tag_pitch_m(board), bottom = top + board.tag_size_m;
      tags.push_back(
          {id_at(board, col, row), {{{left, bottom}, {right, bottom}, {right, top}, {left, top}}}});
    }
  }
  return tags;
}

}  // namespace vlp
