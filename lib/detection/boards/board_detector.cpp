// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/board_detector.h"

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "detection/boards/square_corners.h"
#include "detection/boards/tag_edges.h"
#include "detection/boards/tag_finder.h"
#include "rig/board_layout.h"

namespace vlp {
namespace {

/// Distance from the image border, in px, below which a corner is rejected: its edges are
/// truncated.
constexpr double kMargin = 2;

cv::Mat1f smooth_image(const cv::Mat1b& levels) {
  constexpr double sigma_px = 1;
  cv::Mat exact;
  levels.convertTo(exact, CV_32F);
  cv::Mat1f smoothed;
  cv::GaussianBlur(exact, smoothed, {}, sigma_px);
  return smoothed;
}

bool is_inside(const TagDetection& tag, const cv::Mat& image) {
  return std::all_of(tag.corners_px.begin(), tag.corners_px.end(), [&](const auto& corner) {
    return corner.x() >= kMargin && corner.y() >= kMargin &&
           corner.x() <= image.cols - 1 - kMargin && corner.y() <= image.rows - 1 - kMargin;
  });
}

/// Returns true if more than 10 % of the pixels in the bounding box of a tag are white. The box
/// extends into the white around the tag.
bool is_tag_overexposed(const TagDetection& tag, const cv::Mat1b& levels) {
  constexpr double white = 254, min_white_fraction = 0.1;
  std::vector<cv::Point2f> corners;
  for (const auto& corner : tag.corners_px) {
    corners.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()));
  }
  const cv::Rect box = cv::boundingRect(corners) & cv::Rect(0, 0, levels.cols, levels.rows);
  return !box.empty() && cv::countNonZero(levels(box) >= white) > min_white_fraction * box.area();
}

}  // namespace

std::vector<PointDetection> collect_detected_corners(const BoardDetection& seen) {
  if (!seen.points.empty()) return seen.points;
  std::vector<PointDetection> corners;
  for (const TagDetection& tag : seen.tags) {
    for (std::size_t k = 0; k < 4; ++k) {
      corners.push_back(
          {4 * static_cast<std::size_t>(tag.id) + k, tag.corners_px[k], tag.corner_sds_px[k]});
    }
  }
  return corners;
}

BoardDetector::BoardDetector(const Board& board) {
  for (const BoardTag& tag : list_board_tags(board)) ids_.insert(tag.id);
  if (board.kind != BoardKind::chessboard) {
    const bool aruco = board.corner_squares || board.has_squares();
    finder_ = aruco ? make_aruco_detector(board) : make_apriltag_finder(board);
  }
  if (board.has_squares()) {
    squares_ = std::make_unique<SquareCorners>(board);
  } else if (board.corner_squares) {
    touching_ = std::make_unique<TouchingTags>(board);
  } else {
    print_ = std::make_unique<TagGeometry>(board);
  }
}

BoardDetector::~BoardDetector() = default;

cv::Mat1b scale_to_8_bits(const cv::Mat& image) {
  if (image.depth() == CV_8U) return image;
  double brightest = 0;
  cv::minMaxLoc(image, nullptr, &brightest);
  cv::Mat1b levels;
  image.convertTo(levels, CV_8U, 255 / std::max(brightest, 1.0));
  return levels;
}

BoardDetection BoardDetector::detect_board(const cv::Mat& image) const {
  // Tags are wider, and libapriltag reads out of bounds for images of one or two rows.
  constexpr int min_px = 10;
  if (std::min(image.cols, image.rows) < min_px) return {};
  const cv::Mat1b levels = scale_to_8_bits(image);
  const GrayLevels gray{levels, print_ ? cv::Mat1f() : smooth_image(levels)};
  BoardDetection seen;
  if (!finder_) {
    seen.points = squares_->detect_chessboard(gray);
    if (seen.points.empty()) {
      seen.largest_chessboard_part = squares_->detect_largest_part(levels);
    }
    return seen;
  }
  std::map<int, std::vector<TagDetection>> found;
  for (const TagDetection& tag : finder_->detect_tags(levels)) {
    (ids_.contains(tag.id) ? found[tag.id] : seen.foreign_tags).push_back(tag);
  }
  std::vector<TagDetection> once;
  for (const auto& [id, same] : found) {
    if (same.size() == 1) once.push_back(same.front());
  }
  if (squares_) {
    seen.num_unusable_tags = static_cast<int>(found.size() - once.size());
    seen.tags = once;
    seen.points = squares_->detect_near_markers(seen.tags, gray);
    return seen;
  }
  if (print_) {
    seen.curve_costs = refine_tags(once, levels, *print_);
    seen.tags = once;
  } else {
    auto [tags, rejected_predictions] = touching_->refine_and_complete_tags(once, gray);
    seen.tags = std::move(tags);
    std::erase_if(seen.tags, [&](const TagDetection& tag) {
      return found.contains(tag.id) && found.at(tag.id).size() > 1;
    });
    for (const TagDetection& tag : rejected_predictions) {
      if (is_inside(tag, levels)) found.try_emplace(tag.id, 1, tag);
    }
  }
  for (auto* tags : {&seen.tags, &seen.foreign_tags}) {
    std::erase_if(*tags, [&](const TagDetection& tag) { return !is_inside(tag, levels); });
  }
  std::sort(seen.tags.begin(), seen.tags.end(),
            [](const TagDetection& a, const TagDetection& b) { return a.id < b.id; });
  for (const auto& [id, same] : found) {
    const bool used = std::any_of(seen.tags.begin(), seen.tags.end(),
                                  [id = id](const TagDetection& tag) { return tag.id == id; });
    if (used) continue;
    ++seen.num_unusable_tags;
    seen.num_overexposed_tags += is_tag_overexposed(same.front(), levels) ? 1 : 0;
  }
  return seen;
}

}  // namespace vlp
