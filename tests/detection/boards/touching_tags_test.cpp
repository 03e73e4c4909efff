// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Refinement of tags with corner squares, and of corners next to markers, from given detections.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "detection/boards/drawn_tags.h"
#include "detection/boards/square_corners.h"
#include "rig/board_layout.h"
#include "support/matchers.h"

namespace vlp {
namespace {

GrayLevels smooth(const cv::Mat1b& image) {
  cv::Mat1f smoothed;
  image.convertTo(smoothed, CV_32F);
  cv::GaussianBlur(smoothed, smoothed, {}, 1);
  return {image, smoothed};
}

/// Image of a board of tags with corner squares, as Kalibr prints them, with bits of `bit_px`.
struct DrawnTouchingTags : DrawnTags {
  explicit DrawnTouchingTags(int bit_px, int cols = 4, int rows = 3)
      : DrawnTags(
            {"tag36h11", cols, rows, 0.05, 0.2, 2, true, 0, {false, BoardCorner::bottom_left}},
            bit_px),
        levels(smooth(image)) {}

  GrayLevels levels;
};

TEST(TouchingTags, RefinesDisplacedCorners) {
  for (const int bit_px : {3, 4, 6}) {
    SCOPED_TRACE(bit_px);
    const DrawnTouchingTags drawn(bit_px);
    const TouchingTags touching(drawn.board);
    TagDetection displaced = drawn.truth[5];
    displaced.corners_px[0] += Eigen::Vector2d(0.9, -0.4);
    displaced.corners_px[1] += Eigen::Vector2d(-0.6, -0.7);
    displaced.corners_px[2] += Eigen::Vector2d(0.4, 0.8);
    displaced.corners_px[3] += Eigen::Vector2d(-0.8, 0.5);
    const auto refined = touching.refine_tag_corners(displaced, drawn.levels);
    ASSERT_TRUE(refined);
    EXPECT_EQ(refined->id, displaced.id);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_THAT(refined->corners_px[k], IsNear(drawn.truth[5].corners_px[k], 0.03)) << k;
    }
  }
}

TEST(TouchingTags, RejectsTagWithBitsOfOtherId) {
  const DrawnTouchingTags drawn(4);
  TagDetection other = drawn.truth[5];
  other.id = 9;
  EXPECT_FALSE(TouchingTags(drawn.board).refine_tag_corners(other, drawn.levels));
}

TEST(TouchingTags, FindsAllTagsFromOneTag) {
  const DrawnTouchingTags drawn(4);
  const TouchingTags touching(drawn.board);
  for (const std::size_t seed : {0U, 5U, 11U}) {
    const auto [found, rejected_predictions] =
        touching.refine_and_complete_tags({drawn.truth[seed]}, drawn.levels);
    EXPECT_TRUE(rejected_predictions.empty());
    ASSERT_EQ(found.size(), drawn.truth.size()) << seed;
    EXPECT_EQ(found.front().id, drawn.truth[seed].id);
    for (const TagDetection& tag : found) {
      const auto expected = std::ranges::find(drawn.truth, tag.id, &TagDetection::id);
      ASSERT_NE(expected, drawn.truth.end());
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_THAT(tag.corners_px[k], IsNear(expected->corners_px[k], 0.03)) << tag.id;
        EXPECT_GT(tag.corner_sds_px[k], 0) << tag.id;
      }
    }
  }
}

/// The bits of the tag are covered; its corners and its neighbors are visible.
TEST(BoardDetector, CountsPredictedTagsWithoutFitAsUnusable) {
  const DrawnTouchingTags drawn(5);
  const TagDetection& covered = drawn.truth[5];
  const Eigen::Vector2i at = covered.corners_px[3].array().ceil().cast<int>();
  const BoardDetector detector(drawn.board);
  for (const auto& [level, num_overexposed] : {std::pair(150, 0), std::pair(255, 1)}) {
    cv::Mat1b image = drawn.image.clone();
    image(cv::Rect(at.x() + 10, at.y() + 10, 30, 30)) = static_cast<uchar>(level);
    const BoardDetection seen = detector.detect_board(image);
    EXPECT_EQ(seen.tags.size(), drawn.truth.size() - 1);
    EXPECT_EQ(seen.num_unusable_tags, 1);
    EXPECT_EQ(seen.num_overexposed_tags, num_overexposed);
  }
  EXPECT_EQ(detector.detect_board(drawn.image).num_unusable_tags, 0);
}

/// The first column of tags is outside of the image.
TEST(BoardDetector, CountsNoTagsPredictedOutsideImage) {
  const DrawnTouchingTags drawn(5);
  const int first_px = static_cast<int>(drawn.truth[0].corners_px[1].x()) + 2;
  const cv::Mat1b image =
      drawn.image(cv::Rect(first_px, 0, drawn.image.cols - first_px, drawn.image.rows)).clone();
  const BoardDetection seen = BoardDetector(drawn.board).detect_board(image);
  EXPECT_EQ(seen.tags.size(), 9U);
  EXPECT_EQ(seen.num_unusable_tags, 0);
}

// Places of missing tags are predicted from tags up to 2.2 tag widths away.
TEST(TouchingTags, FindsMissingTagsOnlyNextToOtherTags) {
  DrawnTouchingTags drawn(4, 5, 1);
  cv::Mat1b image = drawn.levels.sharp.clone();
  const Eigen::Vector2i at = drawn.truth[1].corners_px[3].array().round().cast<int>();
  image(cv::Rect(at.x() - 2, at.y() - 2, 44, 44)) = 200;
  const TouchingTags touching(drawn.board);
  EXPECT_EQ(touching.refine_and_complete_tags({drawn.truth[0]}, drawn.levels).tags.size(), 5U);
  EXPECT_LE(touching.refine_and_complete_tags({drawn.truth[0]}, smooth(image)).tags.size(), 1U)
      << "the next tag is 2.4 tag widths away";
  EXPECT_TRUE(touching.refine_and_complete_tags({}, drawn.levels).tags.empty());
}

/// Overexposed white grows by about 1 px on each side, as in photographs of boards in the sun.
TEST(TouchingTags, FindsAllTagsWithOverexposedWhite) {
  for (const int bit_px : {4, 5}) {
    SCOPED_TRACE(bit_px);
    const DrawnTouchingTags drawn(bit_px);
    cv::Mat1b image;
    cv::dilate(drawn.levels.sharp, image, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
    cv::GaussianBlur(image, image, {}, 0.7);
    const BoardDetection seen = BoardDetector(drawn.board).detect_board(image);
    EXPECT_EQ(seen.tags.size(), drawn.truth.size());
    for (const TagDetection& tag : seen.tags) {
      const auto expected = std::ranges::find(drawn.truth, tag.id, &TagDetection::id);
      ASSERT_NE(expected, drawn.truth.end());
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_THAT(tag.corners_px[k], IsNear(expected->corners_px[k], 0.3)) << tag.id;
      }
    }
  }
}

/// Chessboard of 8 x 6 squares, white markers included as plain squares.
struct DrawnSquares {
  static constexpr int kMargin_px = 30;

  explicit DrawnSquares(int size_px) : square_px(size_px) {
    board = {"DICT_5X5_100", 8, 6, 0.015, 1, 1, false, 0, {false, BoardCorner::top_left}};
    board.kind = BoardKind::charuco;
    board.square_size_m = 0.02;
    cv::Mat1b image(6 * square_px + 2 * kMargin_px, 8 * square_px + 2 * kMargin_px, uchar{200});
    for (int row = 0; row < 6; ++row) {
      for (int col = 0; col < 8; ++col) {
        if (!is_square_black(board, col, row)) continue;
        image(cv::Rect(kMargin_px + col * square_px, kMargin_px + row * square_px, square_px,
                       square_px)) = uchar{40};
      }
    }
    cv::GaussianBlur(image, image, {}, 0.8);
    levels = smooth(image);
    for (const BoardTag& place : list_board_tags(board)) {
      TagDetection marker{place.id, {}};
      for (std::size_t k = 0; k < 4; ++k) marker.corners_px[k] = pixel(place.corners_m[k]);
      markers.push_back(marker);
    }
  }
  Eigen::Vector2d pixel(const Eigen::Vector2d& at_m) const {
    return at_m * (square_px / 0.02) + Eigen::Vector2d::Constant(kMargin_px + square_px - 0.5);
  }
  Eigen::Vector2d corner_px(std::size_t index) const {
    return pixel(0.02 * Eigen::Vector2d(double(index % 7), double(index / 7)));
  }
  std::vector<PointDetection> detect(const std::vector<TagDetection>& near) const {
    return SquareCorners(board).detect_near_markers(near, levels);
  }

  Board board;
  int square_px;
  GrayLevels levels;
  std::vector<TagDetection> markers;
};

TEST(SquareCorners, DetectsCornersNearDisplacedMarkers) {
  for (const int square_px : {12, 24, 48}) {
    SCOPED_TRACE(square_px);
    const DrawnSquares drawn(square_px);
    auto markers = drawn.markers;
    for (TagDetection& marker : markers) {
      for (auto& corner : marker.corners_px) corner += Eigen::Vector2d(0.7, -0.6);
    }
    const auto points = drawn.detect(markers);
    ASSERT_EQ(points.size(), 35U);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(points[i].index, i);
      EXPECT_THAT(points[i].pixel, IsNear(drawn.corner_px(i), 0.03)) << i;
    }
  }
}

// Corners nearer than 2 px to the image border are rejected.
TEST(SquareCorners, RejectsCornersWithinTwoPixelsOfImageBorder) {
  const DrawnSquares drawn(24);
  const auto count = [&](const cv::Rect& part) {
    auto markers = drawn.markers;
    for (TagDetection& marker : markers) {
      for (auto& corner : marker.corners_px) corner -= Eigen::Vector2d(part.x, part.y);
    }
    const GrayLevels levels = smooth(drawn.levels.sharp(part).clone());
    return SquareCorners(drawn.board).detect_near_markers(markers, levels).size();
  };
  const cv::Size full = drawn.levels.sharp.size();
  // The first corners are at 53.5 px, the last ones at 197.5 and 149.5 px.
  EXPECT_EQ(count({{0, 0}, full}), 35U);
  EXPECT_EQ(count({51, 0, full.width - 51, full.height}), 35U);
  EXPECT_EQ(count({52, 0, full.width - 52, full.height}), 30U);
  EXPECT_EQ(count({0, 51, full.width, full.height - 51}), 35U);
  EXPECT_EQ(count({0, 52, full.width, full.height - 52}), 28U);
  EXPECT_EQ(count({0, 0, 201, full.height}), 35U);
  EXPECT_EQ(count({0, 0, 200, full.height}), 30U);
  EXPECT_EQ(count({0, 0, full.width, 153}), 35U);
  EXPECT_EQ(count({0, 0, full.width, 152}), 28U);
}

}  // namespace
}  // namespace vlp
