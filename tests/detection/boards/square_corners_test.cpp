// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/core/version.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_board.hpp>
#include <opencv2/objdetect/aruco_dictionary.hpp>
#define VLP_ARUCO_IS_A_CLASS
#else
#include <opencv2/aruco/charuco.hpp>
#endif

#include "detection/boards/board_detector.h"
#include "detection/boards/lattice_order.h"
#include "detection/boards/other_tags.h"
#include "detection/boards/square_corners.h"
#include "rig/board_layout.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr int kSquare_px = 40, kMargin_px = 20;

Board squares(BoardKind kind, int cols, int rows) {
  Board board{"", cols, rows, 0, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = kind;
  board.square_size_m = 0.02;
  if (kind != BoardKind::charuco) return board;
  board.family = "DICT_5X5_100";
  board.tag_size_m = 0.75 * board.square_size_m;
  return board;
}

/// Draws a ChArUco board by OpenCV, slightly blurred.
cv::Mat drawn_by_opencv(const Board& board) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100);
  const cv::Size size(board.cols * kSquare_px + 2 * kMargin_px,
                      board.rows * kSquare_px + 2 * kMargin_px);
  const auto square = static_cast<float>(board.square_size_m);
  const auto marker = static_cast<float>(board.tag_size_m);
  cv::Mat image;
#ifdef VLP_ARUCO_IS_A_CLASS
  cv::aruco::CharucoBoard drawn({board.cols, board.rows}, square, marker, dictionary);
  drawn.setLegacyPattern(board.top_left_white);
  drawn.generateImage(size, image, kMargin_px, 1);
#else
  cv::aruco::CharucoBoard::create(board.cols, board.rows, square, marker, dictionary)
      ->draw(size, image, kMargin_px, 1);
#endif
  cv::GaussianBlur(image, image, {}, 0.7);
  return image;
}

/// Returns the true position of a corner, which lies between pixels.
Eigen::Vector2d corner_position(const Board& board, std::size_t index) {
  const auto cols = static_cast<std::size_t>(board.cols - 1);
  const Eigen::Vector2d node(static_cast<double>(index % cols), static_cast<double>(index / cols));
  return Eigen::Vector2d::Constant(kMargin_px + kSquare_px - 0.5) + kSquare_px * node;
}

cv::Mat drawn_chessboard(const Board& board) {
  cv::Mat image(board.rows * kSquare_px + 2 * kMargin_px, board.cols * kSquare_px + 2 * kMargin_px,
                CV_8U, cv::Scalar(255));
  for (int row = 0; row < board.rows; ++row) {
    for (int col = 0; col < board.cols; ++col) {
      if (!is_square_black(board, col, row)) continue;
      image(cv::Rect(kMargin_px + col * kSquare_px, kMargin_px + row * kSquare_px, kSquare_px,
                     kSquare_px)) = 0;
    }
  }
  cv::GaussianBlur(image, image, {}, 0.7);
  return image;
}

void expect_all_corners(const Board& board, const BoardDetection& seen) {
  ASSERT_EQ(seen.points.size(), static_cast<std::size_t>((board.cols - 1) * (board.rows - 1)));
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    EXPECT_EQ(seen.points[i].index, i);
    EXPECT_LT((seen.points[i].pixel - corner_position(board, i)).norm(), 0.05) << i;
  }
}

TEST(SquareCorners, DetectsAllCornersOfOpencvCharucoBoard) {
  std::vector<Board> boards{squares(BoardKind::charuco, 7, 5), squares(BoardKind::charuco, 7, 6)};
#ifdef VLP_ARUCO_IS_A_CLASS
  // As it was drawn before OpenCV 4.6, with a white square first.
  boards.push_back(boards.back());
  boards.back().top_left_white = true;
#endif
  for (const Board& board : boards) {
    SCOPED_TRACE(board.rows);
    const cv::Mat image = drawn_by_opencv(board);
    const BoardDetection seen = BoardDetector(board).detect_board(image);
    EXPECT_EQ(seen.tags.size(), list_board_tags(board).size());
    EXPECT_TRUE(seen.foreign_tags.empty());
    expect_all_corners(board, seen);
  }
}

TEST(SquareCorners, DetectsVisibleCornersOfTruncatedCharucoBoard) {
  const Board board = squares(BoardKind::charuco, 7, 5);
  const cv::Mat image = drawn_by_opencv(board);
  const cv::Mat part = image(cv::Rect(0, 0, image.cols / 2, image.rows)).clone();
  const BoardDetection seen = BoardDetector(board).detect_board(part);
  EXPECT_GE(seen.points.size(), 8U);
  for (const PointDetection& point : seen.points) {
    EXPECT_LT((point.pixel - corner_position(board, point.index)).norm(), 0.05);
  }
}

// Clutter that looks like a marker of the board at another position.
TEST(SquareCorners, KeepsOnlyAccurateCornersWhenOneMarkerIsDisplaced) {
  const Board board = squares(BoardKind::charuco, 7, 5);
  const cv::Mat1b image = drawn_by_opencv(board);
  cv::Mat1f smoothed;
  image.convertTo(smoothed, CV_32F);
  cv::GaussianBlur(smoothed, smoothed, {}, 1);
  const GrayLevels gray{image, smoothed};
  BoardDetection seen = BoardDetector(board).detect_board(image);
  ASSERT_EQ(seen.tags.size(), list_board_tags(board).size());
  for (const double off_px : {30.0, 1e12}) {
    for (auto& corner_px : seen.tags[7].corners_px) corner_px.x() += off_px;
    const auto points = SquareCorners(board).detect_near_markers(seen.tags, gray);
    EXPECT_GE(points.size(), 8U);
    EXPECT_LT(points.size(), seen.points.size());
    for (const PointDetection& point : points) {
      EXPECT_LT((point.pixel - corner_position(board, point.index)).norm(), 0.05) << point.index;
    }
  }
}

TEST(SquareCorners, NumbersChessboardCornersFromTopLeftOfImage) {
  for (const auto& [cols, rows] : {std::pair(9, 6), std::pair(9, 7), std::pair(8, 8)}) {
    SCOPED_TRACE(cols * 10 + rows);
    const Board board = squares(BoardKind::chessboard, cols, rows);
    const cv::Mat image = drawn_chessboard(board);
    const BoardDetector detector(board);
    expect_all_corners(board, detector.detect_board(image));
    // Upside down what is up is counted first.
    cv::Mat turned;
    cv::rotate(image, turned, cv::ROTATE_180);
    expect_all_corners(board, detector.detect_board(turned));
  }
}

// The squares are 22 x 8 px or 10 x 22 px. The fit at a corner must not reach the adjacent corners.
TEST(SquareCorners, DetectsChessboardAccuratelyInObliqueView) {
  for (const auto& [cols, rows, scale] : {std::tuple(6, 9, Eigen::Array2d(0.55, 0.2)),
                                          std::tuple(9, 6, Eigen::Array2d(0.25, 0.55))}) {
    SCOPED_TRACE(cols);
    const Board board = squares(BoardKind::chessboard, cols, rows);
    cv::Mat image;
    cv::resize(drawn_chessboard(board), image, {}, scale.x(), scale.y(), cv::INTER_AREA);
    const BoardDetection seen = BoardDetector(board).detect_board(image);
    ASSERT_EQ(seen.points.size(), 40U);
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
      const Eigen::Array2d expected = (corner_position(board, i).array() + 0.5) * scale - 0.5;
      EXPECT_EQ(seen.points[i].index, i);
      EXPECT_THAT(seen.points[i].pixel, IsNear(expected.matrix(), 0.05)) << i;
    }
  }
}

/// Photographs of 12 megapixels: squares of 40 to 280 px, with the blur of a phone.
TEST(SquareCorners, DetectsChessboardAccuratelyInLargeImages) {
  const Board board = squares(BoardKind::chessboard, 9, 6);
  for (const auto& [square_px, blur_px] :
       {std::pair(40, 1.5), std::pair(160, 3.0), std::pair(280, 8.0)}) {
    SCOPED_TRACE(square_px);
    const double scale = static_cast<double>(square_px) / kSquare_px;
    cv::Mat drawn;
    cv::resize(drawn_chessboard(board), drawn, {}, scale, scale, cv::INTER_NEAREST);
    cv::Mat image(3001, 4002, CV_8U, cv::Scalar(200));
    const cv::Point at(image.cols - drawn.cols - 317, image.rows - drawn.rows - 201);
    drawn.copyTo(image(cv::Rect(at, drawn.size())));
    cv::GaussianBlur(image, image, {}, blur_px);
    const BoardDetection seen = BoardDetector(board).detect_board(image);
    ASSERT_EQ(seen.points.size(), 40U);
    for (const PointDetection& point : seen.points) {
      const Eigen::Array2d expected = (corner_position(board, point.index).array() + 0.5) * scale -
                                      0.5 + Eigen::Array2d(at.x, at.y);
      EXPECT_THAT(point.pixel, IsNear(expected.matrix(), 0.05)) << point.index;
      EXPECT_GT(point.sd_px, 0) << point.index;
    }
  }
}

TEST(SquareCorners, ReturnsNoCornersForTruncatedChessboard) {
  const Board board = squares(BoardKind::chessboard, 9, 6);
  const cv::Mat image = drawn_chessboard(board);
  const BoardDetection seen =
      BoardDetector(board).detect_board(image(cv::Rect(80, 0, image.cols - 80, image.rows)));
  EXPECT_TRUE(seen.points.empty());
  EXPECT_EQ(seen.largest_chessboard_part[1], 6);
  EXPECT_LT(seen.largest_chessboard_part[0], 9);
}

/// A part of a larger chessboard is not the board, in which OpenCV finds smaller ones.
TEST(SquareCorners, ReturnsNoCornersForLargerChessboard) {
  const cv::Mat image = drawn_chessboard(squares(BoardKind::chessboard, 10, 7));
  for (const auto& [cols, rows] :
       {std::pair(9, 7), std::pair(10, 6), std::pair(9, 6), std::pair(8, 5), std::pair(5, 7)}) {
    const BoardDetection seen =
        BoardDetector(squares(BoardKind::chessboard, cols, rows)).detect_board(image);
    EXPECT_TRUE(seen.points.empty()) << cols << " x " << rows;
    auto size = seen.largest_chessboard_part;
    std::ranges::sort(size);
    EXPECT_EQ(size, (std::array{7, 10})) << cols << " x " << rows;
  }
}

/// A corner in the shadow of an edge, or covered, is dropped; the others are used.
TEST(SquareCorners, DropsCoveredCornerOfChessboard) {
  const Board board = squares(BoardKind::chessboard, 9, 6);
  cv::Mat image = drawn_chessboard(board);
  const Eigen::Vector2d covered = corner_position(board, 19);
  cv::circle(image, cv::Point(static_cast<int>(covered.x()), static_cast<int>(covered.y())), 5,
             cv::Scalar(128), -1);
  const BoardDetection seen = BoardDetector(board).detect_board(image);
  EXPECT_GE(seen.points.size(), 39U);
  for (const PointDetection& point : seen.points) {
    EXPECT_THAT(point.pixel, IsNear(corner_position(board, point.index), 0.05)) << point.index;
  }
}

TEST(SquareCorners, ReturnsNoCornersIfSquaresAreCovered) {
  const Board board = squares(BoardKind::chessboard, 9, 6);
  cv::Mat image = drawn_chessboard(board);
  image(cv::Rect(100, 100, 100, 60)) = 128;
  EXPECT_TRUE(BoardDetector(board).detect_board(image).points.empty());
}

TEST(OtherBoardKinds, NamesMarkerDictionaryOfImage) {
  Board charuco = squares(BoardKind::charuco, 7, 5);
  const cv::Mat markers = drawn_by_opencv(charuco);
  charuco.family = "DICT_4X4_50";
  EXPECT_EQ(describe_other_tags(charuco, markers),
            "the image shows markers of DICT_5X5, the largest of id 16");
}

TEST(RenumberLattice, ReversesRowsThatAreNumberedUpwards) {
  std::vector<PointDetection> points;
  for (std::size_t i = 0; i < 12; ++i) {
    points.push_back({i, {10.0 * static_cast<double>(i % 4), -10.0 * static_cast<double>(i / 4)}});
  }
  renumber_lattice(points, 4, 3, false);
  EXPECT_EQ(points[0].pixel, Eigen::Vector2d(0, -20));
  EXPECT_EQ(points[11].pixel, Eigen::Vector2d(30, 0));
}

TEST(BoardDetector, ConstructorThrowsForUnknownMarkerDictionary) {
  Board board = squares(BoardKind::charuco, 7, 5);
  board.family = "DICT_9X9_50";
  EXPECT_THROW(BoardDetector{board}, std::invalid_argument);
}

}  // namespace
}  // namespace vlp
