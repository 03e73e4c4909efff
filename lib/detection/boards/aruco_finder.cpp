// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <opencv2/core/version.hpp>
// OpenCV 4.7 moved ArUco from its extra modules into objdetect, with another interface.
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#define VLP_ARUCO_IS_A_CLASS
#else
#include <opencv2/aruco.hpp>
#endif

#include <stdexcept>

#include "detection/boards/tag_finder.h"

namespace vlp {
namespace {

int dictionary_of(const std::string& family) {
  if (family == "tag36h11") return cv::aruco::DICT_APRILTAG_36h11;
  if (family == "tag25h9") return cv::aruco::DICT_APRILTAG_25h9;
  if (family == "tag16h5") return cv::aruco::DICT_APRILTAG_16h5;
  throw std::invalid_argument(
      "boards with corner squares can have tags of the families tag36h11, "
      "tag25h9 and tag16h5, not " +
      family);
}

class ArucoFinder : public TagFinder {
 public:
  explicit ArucoFinder(const Board& board)
      : dictionary_(dictionary_of(board.family)), border_bits_(board.border_bits) {}

  std::vector<SeenTag> find(const cv::Mat1b& image) const override {
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
#ifdef VLP_ARUCO_IS_A_CLASS
    cv::aruco::DetectorParameters parameters;
    parameters.markerBorderBits = border_bits_;
    const cv::aruco::ArucoDetector detector(cv::aruco::getPredefinedDictionary(dictionary_),
                                            parameters);
    detector.detectMarkers(image, corners, ids);
#else
    const auto parameters = cv::aruco::DetectorParameters::create();
    parameters->markerBorderBits = border_bits_;
    cv::aruco::detectMarkers(image, cv::aruco::getPredefinedDictionary(dictionary_), corners, ids,
                             parameters);
#endif
    // OpenCV counts corners clockwise from the top left, of tags that are turned by 180 degrees
    // against libapriltag's.
    constexpr std::size_t opencv_corner[] = {1, 0, 3, 2};
    std::vector<SeenTag> tags(ids.size());
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
  int dictionary_;
  int border_bits_;
};

}  // namespace

std::unique_ptr<TagFinder> aruco_finder(const Board& board) {
  return std::make_unique<ArucoFinder>(board);
}

}  // namespace vlp
