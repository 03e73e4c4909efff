// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "detection/boards/tag_pattern.h"
#include "rig/board_layout.h"

namespace vlp {

/// Blurred image of a board of AprilTags with bits of `bit_px`, and the true corners of its tags.
/// Only families with a black border.
struct DrawnTags {
  static constexpr int kMargin_px = 40;
  static constexpr uchar kBlack = 40, kWhite = 200;

  DrawnTags(const Board& drawn_board, int bit_px) : board(drawn_board) {
    const TagFamily family = make_tag_family(board.family);
    const int width_px = tag_width_bits(*family, board.border_bits) * bit_px;
    const int gap_px = static_cast<int>(std::lround(board.tag_spacing * width_px));
    const double px_per_m = width_px / board.tag_size_m;
    image = cv::Mat1b(board.rows * (width_px + gap_px) + 2 * kMargin_px,
                      board.cols * (width_px + gap_px) + 2 * kMargin_px, kWhite);
    if (board.corner_squares) draw_corner_squares(width_px, gap_px);
    for (const BoardTag& place : list_board_tags(board)) {
      const Eigen::Vector2i at =
          (place.corners_m[3] * px_per_m).array().round().cast<int>() + kMargin_px;
      const Eigen::Vector2d low = at.cast<double>().array() - 0.5;  // edges are between pixels
      const Eigen::Vector2d high = low.array() + width_px;
      truth.push_back({place.id, {{{low.x(), high.y()}, high, {high.x(), low.y()}, low}}});
      image(cv::Rect(at.x(), at.y(), width_px, width_px)) = kBlack;
      for (uint32_t bit = 0; bit < family->nbits; ++bit) {
        if (!is_tag_bit_white(*family, place.id, bit)) continue;
        const int column = static_cast<int>(family->bit_x[bit]) + board.border_bits - 1,
                  row = static_cast<int>(family->bit_y[bit]) + board.border_bits - 1;
        image(cv::Rect(at.x() + bit_px * column, at.y() + bit_px * row, bit_px, bit_px)) = kWhite;
      }
    }
    cv::GaussianBlur(image, image, {}, 0.8);
  }

  Board board;
  cv::Mat1b image;
  std::vector<TagDetection> truth;

 private:
  void draw_corner_squares(int width_px, int gap_px) {
    for (int row = 0; row <= board.rows; ++row) {
      for (int col = 0; col <= board.cols; ++col) {
        image(cv::Rect(kMargin_px + col * (width_px + gap_px) - gap_px,
                       kMargin_px + row * (width_px + gap_px) - gap_px, gap_px, gap_px)) = kBlack;
      }
    }
  }
};

}  // namespace vlp
