// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/board_layout.h"

namespace vlp {
namespace {

int compute_tag_id_at(const Board& board, int col, int row) {
  const auto [column_major, from] = board.id_order;
  const bool from_right = from == BoardCorner::bottom_right || from == BoardCorner::top_right;
  const bool from_bottom = from == BoardCorner::bottom_left || from == BoardCorner::bottom_right;
  const int along_cols = from_right ? board.cols - 1 - col : col;
  const int along_rows = from_bottom ? board.rows - 1 - row : row;
  return board.first_id + (column_major ? along_cols * board.rows + along_rows
                                        : along_rows * board.cols + along_cols);
}

std::vector<BoardTag> make_markers(const Board& board) {
  const double margin_m = (board.square_size_m - board.tag_size_m) / 2;
  std::vector<BoardTag> markers;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      if (is_square_black(board, col, row)) continue;
      const double left = (col - 1) * board.square_size_m + margin_m;
      const double top = (row - 1) * board.square_size_m + margin_m;
      const double right = left + board.tag_size_m, bottom = top + board.tag_size_m;
      markers.push_back({board.first_id + static_cast<int>(markers.size()),
                         {{{left, bottom}, {right, bottom}, {right, top}, {left, top}}}});
    }
  }
  return markers;
}

}  // namespace

double compute_tag_pitch_m(const Board& board) {
  return board.has_squares() ? board.square_size_m : board.tag_size_m * (1 + board.tag_spacing);
}

bool is_square_black(const Board& board, int col, int row) {
  return ((col + row) % 2 == 0) != board.top_left_white;
}

Eigen::Vector2d compute_tag_field_size_m(const Board& board) {
  if (board.has_squares()) {
    return Eigen::Vector2d(board.cols - 2, board.rows - 2) * board.square_size_m;
  }
  return Eigen::Vector2d(board.cols - 1, board.rows - 1) * compute_tag_pitch_m(board) +
         Eigen::Vector2d::Constant(board.tag_size_m);
}

std::vector<Eigen::Vector2d> list_inner_corners_m(const Board& board) {
  std::vector<Eigen::Vector2d> corners_m;
  for (int row = 0; row < board.rows - 1; ++row) {
    for (int col = 0; col < board.cols - 1; ++col) {
      corners_m.emplace_back(col * board.square_size_m, row * board.square_size_m);
    }
  }
  return corners_m;
}

std::vector<BoardTag> list_board_tags(const Board& board) {
  if (board.kind == BoardKind::charuco) return make_markers(board);
  if (board.kind == BoardKind::chessboard) return {};
  std::vector<BoardTag> tags;
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      const double left = col * compute_tag_pitch_m(board), right = left + board.tag_size_m;
      const double top = row * compute_tag_pitch_m(board), bottom = top + board.tag_size_m;
      tags.push_back({compute_tag_id_at(board, col, row),
                      {{{left, bottom}, {right, bottom}, {right, top}, {left, top}}}});
    }
  }
  return tags;
}

}  // namespace vlp
