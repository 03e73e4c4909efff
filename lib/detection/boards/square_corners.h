// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/boards/edge_crossing.h"
#include "detection/boards/tag_pattern.h"
#include "rig/board_layout.h"

namespace vlp {

/// Detector of the corners where the squares of a chessboard or of a ChArUco board touch. Corners
/// are the intersections of the edges (fit_edge_crossing()), or the saddle points if
/// their fit fails. Safe to share between threads.
class SquareCorners {
 public:
  explicit SquareCorners(const Board& board);

  /// Detects the inner corners of a chessboard: searches by OpenCV in the image at several
  /// resolutions, then a sub-pixel fit at full resolution. Returns all corners, or none if the
  /// board is not completely in view, or is a part of a larger chessboard. They are numbered row by
  /// row, with the rows to the right in the image (renumber_lattice()). The first corner may
  /// be at either end of the board, which looks the same rotated by 180 degrees.
  std::vector<PointDetection> detect_chessboard(const GrayLevels& image) const;

  /// Returns BoardDetection::largest_chessboard_part of an image that does not show all squares.
  std::array<int, 2> detect_largest_part(const cv::Mat1b& image) const;

  /// Detects the corners next to markers whose own corners are accurate to 1 to 2 px.
  std::vector<PointDetection> detect_near_markers(const std::vector<TagDetection>& markers,
                                                  const GrayLevels& image) const;

 private:
  /// Prediction of a corner: its pixel, the next corners along the row and the column, and a
  /// radius. Within this radius only the squares that touch at the corner are visible.
  struct Guess {
    std::size_t index;
    Eigen::Vector2d pixel;
    std::array<Eigen::Vector2d, 2> next;
    double free_px;
  };
  std::vector<PointDetection> refine_corner_guesses(const std::vector<Guess>& guesses,
                                                    const GrayLevels& image) const;
  /// Finds the corners of a chessboard, accurate to 0.2 px of a reduced image. Empty if no search
  /// finds it.
  std::vector<PointDetection> search_chessboard(const cv::Mat1b& image) const;

  int cols_, rows_;
  double square_size_m_, margin_m_;
  std::vector<BoardTag> layout_;
};

/// Returns the smallest and the largest factor by which SquareCorners reduces an image of this size
/// to find a chessboard.
std::array<int, 2> get_reduction_range(const cv::Size& size);

/// Detector of tags whose corners touch black squares, from tags found roughly by another detector.
class TouchingTags {
 public:
  explicit TouchingTags(const Board& board);

  /// Returns the tag with refined corners: the intersections of the edges next to the saddle points
  /// at its corners. Returns std::nullopt if a corner cannot be fitted, or if the bits between the
  /// corners are not those of the tag.
  std::optional<TagDetection> refine_tag_corners(TagDetection tag, const GrayLevels& image) const;

  struct CompletedTags {
    /// Tags that refine_tag_corners() accepts, in the order of acceptance.
    std::vector<TagDetection> tags;
    /// Predictions from `tags` that it rejects, in the image or outside.
    std::vector<TagDetection> rejected_predictions;
  };
  /// Refines the tags of `rough`, then predicts the others by a homography of the nearest refined
  /// tags. If that fails, the nearest tags of `rough` predict a tag: an overexposed board may have
  /// few tags, and none that can be refined. They may be wrong; refined tags take precedence.
  CompletedTags refine_and_complete_tags(const std::vector<TagDetection>& rough,
                                         const GrayLevels& image) const;

 private:
  std::optional<TagDetection> predict_missing_tag(const BoardTag& missing,
                                                  const std::vector<TagDetection>& tags) const;

  std::vector<BoardTag> layout_;
  TagFamily family_;
  int border_bits_;
  double tag_size_m_;
  /// Width of a corner square or of the black border, whichever is smaller, as a fraction of a
  /// tag's edge.
  double free_fraction_;
};

}  // namespace vlp
