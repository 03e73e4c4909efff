// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/opencv_boards_library.h"

#include <dlfcn.h>

#include "codecs/load_function.h"

namespace vlp {
namespace {

const OpencvBoardFunctions& opencv_board_functions() {
  static const OpencvBoardFunctions& functions = *load_function<const OpencvBoardFunctions*()>(
      VLP_OPENCV_BOARDS_LIBRARY, "vlp_opencv_board_functions", "boards cannot be processed",
      RTLD_NOW)();
  return functions;
}

}  // namespace

std::unique_ptr<TagFinder> make_aruco_detector(const Board& board) {
  return opencv_board_functions().make_aruco_detector(board);
}

ArucoMarker make_aruco_marker(const std::string& dictionary, int id) {
  return opencv_board_functions().make_aruco_marker(dictionary, id);
}

std::vector<cv::Point2f> detect_square_corners(const cv::Mat& image, const cv::Size& size,
                                               ChessboardSearch search) {
  return opencv_board_functions().detect_square_corners(image, size, search);
}

cv::Size detect_chessboard_size(const cv::Mat& image, const cv::Size& min_size) {
  return opencv_board_functions().detect_chessboard_size(image, min_size);
}

std::vector<PlanarPose> list_planar_poses(const std::vector<cv::Point3d>& in_board_m,
                                          const std::vector<cv::Point2d>& normalized) {
  return opencv_board_functions().list_planar_poses(in_board_m, normalized);
}

}  // namespace vlp
