// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/boards/saddle_point.h"
#include "rig/board_layout.h"

namespace vlp {

/// Finds the corners in which the squares of a chessboard or of a ChArUco board touch, where their
/// edges cross (edge_crossing()), or else at the saddle point. Safe to share between threads.
class SquareCorners {
 public:
  explicit SquareCorners(const Board& board);

  /// Every corner of a chessboard, which has to be wholly in view, by OpenCV's
  /// findChessboardCornersSB(); else none. Which end of it is up is not told (order_lattice()).
  std::vector<SeenPoint> of_chessboard(const GreyLevels& image) const;

  /// The corners beside the markers that were found, to a pixel or two.
  std::vector<SeenPoint> beside(const std::vector<SeenTag>& markers, const GreyLevels& image) const;

 private:
  /// A corner where it is expected, the next ones along the row and along the column, and the
  /// distance within which there is nothing but the squares that touch there.
  struct Guess {
    std::size_t index;
    Eigen::Vector2d pixel;
    std::array<Eigen::Vector2d, 2> next;
    double free_px;
  };
  std::vector<SeenPoint> exact(const std::vector<Guess>& guesses, const GreyLevels& image) const;

  int cols_, rows_;
  double square_size_m_, margin_m_;
  std::vector<BoardTag> layout_;
};

/// How many squares of a chessboard, along one edge and along the other, the image shows: all, or
/// those that are in it; {0, 0} when it shows none. image: grey levels of 8 or 16 bits.
std::array<int, 2> chessboard_shown(const cv::Mat& image);

}  // namespace vlp
