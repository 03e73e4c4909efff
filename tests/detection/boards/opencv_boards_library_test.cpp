// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/opencv_boards_library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "detection/boards/tag_finder.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

TEST(EstimatePlanarPoses, OnePoseIsExactForExactPoints) {
  const Eigen::Vector3d rotation_vector(0.3, -0.4, 0.7), translation_m(0.1, -0.05, 0.8);
  const Eigen::AngleAxisd rotation(rotation_vector.norm(), rotation_vector.normalized());
  std::vector<cv::Point3d> in_board_m;
  std::vector<cv::Point2d> normalized;
  for (const double x : {0.0, 0.1, 0.2}) {
    for (const double y : {0.0, 0.15}) {
      const Eigen::Vector2d z = (rotation * Eigen::Vector3d(x, y, 0) + translation_m).hnormalized();
      in_board_m.emplace_back(x, y, 0);
      normalized.emplace_back(z.x(), z.y());
    }
  }
  const auto poses = estimate_planar_poses(in_board_m, normalized);
  ASSERT_FALSE(poses.empty());
  EXPECT_TRUE(std::ranges::any_of(poses, [&](const PlanarPose& pose) {
    return Eigen::Vector3d(pose.rotation_vector.val).isApprox(rotation_vector, 1e-6) &&
           Eigen::Vector3d(pose.translation_m.val).isApprox(translation_m, 1e-6);
  }));
}

/// Returns a chessboard of `columns` x `rows` squares of 40 px on white.
cv::Mat1b draw_chessboard(int columns, int rows) {
  constexpr int square_px = 40;
  cv::Mat1b image((rows + 2) * square_px, (columns + 2) * square_px, uchar{255});
  for (int row = 0; row < rows; ++row) {
    for (int column = row % 2; column < columns; column += 2) {
      image({(column + 1) * square_px, (row + 1) * square_px, square_px, square_px}) = uchar{0};
    }
  }
  return image;
}

class FindChessboardCorners : public testing::TestWithParam<ChessboardSearch> {};
INSTANTIATE_TEST_SUITE_P(Searches, FindChessboardCorners,
                         testing::Values(ChessboardSearch::by_squares,
                                         ChessboardSearch::by_saddle_points));

TEST_P(FindChessboardCorners, ReturnsAllInnerCorners) {
  const auto corners = find_chessboard_corners(draw_chessboard(7, 6), {6, 5}, GetParam());
  ASSERT_EQ(corners.size(), 30U);
  // The board has no unique beginning: rows start at the top left or at the bottom right.
  const bool is_reversed = corners.front().x > corners.back().x;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const cv::Point2f& corner = corners[is_reversed ? corners.size() - 1 - i : i];
    // Edges are on the borders between pixels, half a pixel from the centers of pixels.
    EXPECT_NEAR(corner.x, 79.5 + 40 * static_cast<double>(i % 6), 0.2) << i;
    EXPECT_NEAR(corner.y, 79.5 + 40 * static_cast<double>(i / 6), 0.2) << i;
  }
}

TEST_P(FindChessboardCorners, ReturnsNoneForImageWithoutBoard) {
  EXPECT_THAT(find_chessboard_corners(cv::Mat1b(200, 300, uchar{128}), {6, 5}, GetParam()),
              testing::IsEmpty());
}

/// Marker 0 of the published dictionary of 4 x 4 bits.
TEST(MakeArucoMarker, ReturnsBitsRowByRowAndThrowsForMissingMarkers) {
  const ArucoMarker marker = make_aruco_marker("DICT_4X4_50", 0);
  EXPECT_EQ(marker.width, 4);
  EXPECT_THAT(marker.white, testing::ElementsAre(true, false, true, true,   //
                                                 false, true, false, true,  //
                                                 false, false, true, true,  //
                                                 false, false, true, false));
  EXPECT_THAT(make_aruco_marker("DICT_4X4_50", 49).white, testing::SizeIs(16));
  for (const int id : {-1, 50}) {
    EXPECT_THROW(make_aruco_marker("DICT_4X4_50", id), std::invalid_argument) << id;
  }
}

TEST(MakeArucoMarker, HasWidthAndNumberOfMarkersOfDictionary) {
  std::vector<std::tuple<std::string, int, int>> dictionaries{{"DICT_ARUCO_ORIGINAL", 5, 1024},
                                                              {"DICT_APRILTAG_16h5", 4, 30},
                                                              {"DICT_APRILTAG_25h9", 5, 35},
                                                              {"DICT_APRILTAG_36h10", 6, 2320},
                                                              {"DICT_APRILTAG_36h11", 6, 587}};
  for (const int width : {4, 5, 6, 7}) {
    for (const int count : {50, 100, 250, 1000}) {
      dictionaries.emplace_back("DICT_" + std::to_string(width) + "X" + std::to_string(width) +
                                    "_" + std::to_string(count),
                                width, count);
    }
  }
  for (const auto& [name, width, count] : dictionaries) {
    const ArucoMarker last = make_aruco_marker(name, count - 1);
    EXPECT_EQ(last.width, width) << name;
    EXPECT_EQ(last.white.size(), static_cast<std::size_t>(width * width)) << name;
    EXPECT_THROW(make_aruco_marker(name, count), std::invalid_argument) << name;
  }
}

TEST(MakeArucoMarker, MessageListsMarkersOrDictionaries) {
  const auto reject = [](const std::string& dictionary, int id) {
    return rejection_message<std::invalid_argument>([&] { make_aruco_marker(dictionary, id); });
  };
  EXPECT_EQ(reject("DICT_4X4_50", 50), "DICT_4X4_50 has no marker 50, only 0 to 49");
  EXPECT_THAT(reject("DICT_9X9_50", 0),
              testing::StartsWith("OpenCV has no dictionary 'DICT_9X9_50', but DICT_4X4_100, "
                                  "DICT_4X4_1000, DICT_4X4_250, DICT_4X4_50, DICT_5X5_100"));
  EXPECT_THAT(reject("DICT_9X9_50", 0), testing::EndsWith(", DICT_ARUCO_ORIGINAL"));
}

TEST(MakeArucoDetector, MessageListsTagFamilies) {
  Board board{"tagCircle21h7", 2, 2, 0.05, 0.3, 1, true, 0, {false, BoardCorner::top_left}};
  EXPECT_EQ(rejection_message<std::invalid_argument>([&] { make_aruco_detector(board); }),
            "boards with corner squares can have tags of the families tag36h11, tag25h9 and "
            "tag16h5, not tagCircle21h7");
}

TEST(FindChessboardSizeInCorners, ReturnsSizeOfLargerBoard) {
  const cv::Size size = find_chessboard_size_in_corners(draw_chessboard(7, 6), {3, 3});
  EXPECT_EQ(std::min(size.width, size.height), 5);
  EXPECT_EQ(std::max(size.width, size.height), 6);
}

TEST(FindChessboardSizeInCorners, ReturnsZeroForImageWithoutBoard) {
  EXPECT_EQ(find_chessboard_size_in_corners(cv::Mat1b(200, 300, uchar{128}), {3, 3}), cv::Size());
}

}  // namespace
}  // namespace vlp
