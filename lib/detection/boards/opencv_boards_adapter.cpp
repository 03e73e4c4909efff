// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <opencv2/calib3d.hpp>
#include <opencv2/core/version.hpp>
// OpenCV 4.7 moved ArUco from its extra modules into objdetect, with another interface.
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#define VLP_ARUCO_IS_A_CLASS
#else
#include <opencv2/aruco.hpp>
#endif

#include <array>
#include <map>
#include <stdexcept>

#include "detection/boards/opencv_boards_library.h"

namespace vlp {
namespace {

/// Returns OpenCV's dictionaries by name, including those of the AprilTag families.
const std::map<std::string, int>& list_dictionaries() {
  using namespace cv::aruco;
  static const std::map<std::string, int> all{
      {"DICT_4X4_50", DICT_4X4_50},
      {"DICT_4X4_100", DICT_4X4_100},
      {"DICT_4X4_250", DICT_4X4_250},
      {"DICT_4X4_1000", DICT_4X4_1000},
      {"DICT_5X5_50", DICT_5X5_50},
      {"DICT_5X5_100", DICT_5X5_100},
      {"DICT_5X5_250", DICT_5X5_250},
      {"DICT_5X5_1000", DICT_5X5_1000},
      {"DICT_6X6_50", DICT_6X6_50},
      {"DICT_6X6_100", DICT_6X6_100},
      {"DICT_6X6_250", DICT_6X6_250},
      {"DICT_6X6_1000", DICT_6X6_1000},
      {"DICT_7X7_50", DICT_7X7_50},
      {"DICT_7X7_100", DICT_7X7_100},
      {"DICT_7X7_250", DICT_7X7_250},
      {"DICT_7X7_1000", DICT_7X7_1000},
      {"DICT_ARUCO_ORIGINAL", DICT_ARUCO_ORIGINAL},
      {"DICT_APRILTAG_16h5", DICT_APRILTAG_16h5},
      {"DICT_APRILTAG_25h9", DICT_APRILTAG_25h9},
      {"DICT_APRILTAG_36h10", DICT_APRILTAG_36h10},
      {"DICT_APRILTAG_36h11", DICT_APRILTAG_36h11},
  };
  return all;
}

int look_up_dictionary(const std::string& name) {
  const auto found = list_dictionaries().find(name);
  if (found != list_dictionaries().end()) return found->second;
  std::string names;
  for (const auto& [known, number] : list_dictionaries()) {
    names += (names.empty() ? "" : ", ") + known;
  }
  throw std::invalid_argument("OpenCV has no dictionary '" + name + "', but " + names);
}

#ifdef VLP_ARUCO_IS_A_CLASS
using Dictionary = cv::aruco::Dictionary;
const cv::aruco::Dictionary& get_dictionary(const Dictionary& dictionary) { return dictionary; }
#else
using Dictionary = cv::Ptr<cv::aruco::Dictionary>;
const cv::aruco::Dictionary& get_dictionary(const Dictionary& dictionary) { return *dictionary; }
#endif

int require_dictionary(const std::string& family) {
  if (family == "tag36h11") return cv::aruco::DICT_APRILTAG_36h11;
  if (family == "tag25h9") return cv::aruco::DICT_APRILTAG_25h9;
  if (family == "tag16h5") return cv::aruco::DICT_APRILTAG_16h5;
  throw std::invalid_argument(
      "boards with corner squares can have tags of the families tag36h11, "
      "tag25h9 and tag16h5, not " +
      family);
}

/// Margin of a bit's cell that is not read, as a fraction of its width. White grows by lens blur
/// and overexposure, so that only the middle of a black cell is certainly black.
constexpr double kIgnoredCellMargin = 0.3;

class ArucoFinder : public TagFinder {
 public:
  explicit ArucoFinder(const Board& board)
      : charuco_(board.kind == BoardKind::charuco),
        dictionary_(cv::aruco::getPredefinedDictionary(
            charuco_ ? look_up_dictionary(board.family) : require_dictionary(board.family))),
        border_bits_(board.border_bits) {}

  std::vector<TagDetection> detect_tags(const cv::Mat1b& image) const override {
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
#ifdef VLP_ARUCO_IS_A_CLASS
    cv::aruco::DetectorParameters parameters;
    parameters.markerBorderBits = border_bits_;
    parameters.perspectiveRemoveIgnoredMarginPerCell = kIgnoredCellMargin;
    const cv::aruco::ArucoDetector detector(dictionary_, parameters);
    detector.detectMarkers(image, corners, ids);
#else
    const auto parameters = cv::aruco::DetectorParameters::create();
    parameters->markerBorderBits = border_bits_;
    parameters->perspectiveRemoveIgnoredMarginPerCell = kIgnoredCellMargin;
    cv::aruco::detectMarkers(image, dictionary_, corners, ids, parameters);
#endif
    // OpenCV counts corners clockwise from the top left. Its AprilTags are rotated by 180 degrees
    // relative to libapriltag's.
    constexpr std::array<std::size_t, 4> of_markers{3, 2, 1, 0}, of_tags{1, 0, 3, 2};
    const auto& opencv_corner = charuco_ ? of_markers : of_tags;
    std::vector<TagDetection> tags(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      tags[i].id = ids[i];
      for (std::size_t k = 0; k < 4; ++k) {
        const cv::Point2f& corner = corners[i][opencv_corner[k]];
        tags[i].corners_px[k] = {corner.x, corner.y};
      }
    }
    return tags;
  }

 private:
  bool charuco_;
  Dictionary dictionary_;
  int border_bits_;
};

ArucoMarker make_marker(const std::string& name, int id) {
  const Dictionary dictionary = cv::aruco::getPredefinedDictionary(look_up_dictionary(name));
  const cv::Mat& codes = get_dictionary(dictionary).bytesList;
  const int width = get_dictionary(dictionary).markerSize;
  if (id < 0 || id >= codes.rows) {
    throw std::invalid_argument(name + " has no marker " + std::to_string(id) + ", only 0 to " +
                                std::to_string(codes.rows - 1));
  }
  const cv::Mat1b bits =
      cv::aruco::Dictionary::getBitsFromByteList(codes.rowRange(id, id + 1), width);
  ArucoMarker marker{width, {}};
  for (const uchar bit : bits) marker.white.push_back(bit != 0);
  return marker;
}

std::unique_ptr<TagFinder> make_aruco_finder(const Board& board) {
  return std::make_unique<ArucoFinder>(board);
}

constexpr int kChessboardFlags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE;

/// Seeds OpenCV's random number generator equally for each image, so that results are reproducible.
void seed_generator() { cv::theRNG().state = 1; }

std::vector<cv::Point2f> detect_corners(const cv::Mat& image, const cv::Size& size,
                                        ChessboardSearch search) {
  std::vector<cv::Point2f> corners;
  seed_generator();
  const bool found = search == ChessboardSearch::by_squares
                         ? cv::findChessboardCorners(image, size, corners)
                         : cv::findChessboardCornersSB(image, size, corners, kChessboardFlags);
  return found ? corners : std::vector<cv::Point2f>();
}

cv::Size detect_size_in_corners(const cv::Mat& image, const cv::Size& min_size) {
  std::vector<cv::Point2f> corners;
  cv::Mat corner_metadata;  // one element per corner
  seed_generator();
  const bool found = cv::findChessboardCornersSB(
      image, min_size, corners, kChessboardFlags | cv::CALIB_CB_LARGER, corner_metadata);
  return found ? corner_metadata.size() : cv::Size();
}

std::vector<PlanarPose> estimate_poses(const std::vector<cv::Point3d>& in_board_m,
                                       const std::vector<cv::Point2d>& normalized) {
  std::vector<cv::Mat> rotations, translations;
  cv::solvePnPGeneric(in_board_m, normalized, cv::Matx33d::eye(), cv::noArray(), rotations,
                      translations, false, cv::SOLVEPNP_IPPE);
  std::vector<PlanarPose> poses;
  poses.reserve(rotations.size());
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    poses.push_back(
        {cv::Vec3d(rotations[i].ptr<double>()), cv::Vec3d(translations[i].ptr<double>())});
  }
  return poses;
}

}  // namespace
}  // namespace vlp

/// The function that opencv_boards_library.cpp calls.
extern "C" __attribute__((visibility("default"))) const vlp::OpencvBoardFunctions*
vlp_opencv_board_functions() {
  static constexpr vlp::OpencvBoardFunctions functions{
      &vlp::make_aruco_finder, &vlp::make_marker, &vlp::detect_corners,
      &vlp::detect_size_in_corners, &vlp::estimate_poses};
  return &functions;
}
