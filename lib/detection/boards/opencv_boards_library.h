// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "detection/boards/tag_finder.h"

/// Functions of OpenCV's modules calib3d and aruco. They are in a separate library, which is loaded
/// at the first call, because these modules load two others and most programs process no board.
/// Each function throws std::runtime_error if the library cannot be loaded.
namespace vlp {

/// Search of OpenCV for a chessboard: by the outlines of squares (findChessboardCorners()), which
/// is faster if the board is there, or by saddle points (findChessboardCornersSB()).
enum class ChessboardSearch { by_squares, by_saddle_points };

/// Returns the inner corners of a chessboard of `size` corners per row and column, row by row from
/// a corner of the board, pixels; accurate to 0.2 px. Empty if the image shows no such board. A
/// part of a larger chessboard may be returned. Equal images give equal corners.
std::vector<cv::Point2f> detect_square_corners(const cv::Mat& image, const cv::Size& size,
                                               ChessboardSearch search);

/// Returns the number of inner corners per row and column of the chessboard in the image; (0, 0) if
/// there is none of `min_size` or more.
cv::Size detect_chessboard_size(const cv::Mat& image, const cv::Size& min_size);

/// Pose of a board: rotation vector (axis times angle, rad) and translation, m, from the board
/// frame to the camera frame.
struct PlanarPose {
  cv::Vec3d rotation_vector, translation_m;
};

/// Returns the two poses of a planar board that agree best with observed points, by IPPE (Collins
/// and Bartoli, 2014).
/// @param in_board_m  four or more points of the board, z = 0, m
/// @param normalized  their images on the plane z = 1 of the camera frame
std::vector<PlanarPose> list_planar_poses(const std::vector<cv::Point3d>& in_board_m,
                                          const std::vector<cv::Point2d>& normalized);

/// Addresses of the functions of opencv_boards_adapter.cpp that implement the functions above,
/// make_aruco_detector() and make_aruco_marker().
struct OpencvBoardFunctions {
  std::unique_ptr<TagFinder> (*make_aruco_detector)(const Board&);
  ArucoMarker (*make_aruco_marker)(const std::string&, int);
  std::vector<cv::Point2f> (*detect_square_corners)(const cv::Mat&, const cv::Size&,
                                                    ChessboardSearch);
  cv::Size (*detect_chessboard_size)(const cv::Mat&, const cv::Size&);
  std::vector<PlanarPose> (*list_planar_poses)(const std::vector<cv::Point3d>&,
                                               const std::vector<cv::Point2d>&);
};

}  // namespace vlp
