// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "rig/board.h"

namespace vlp {

class TagFinder;
class TagGeometry;
class TouchingTags;
class SquareCorners;

/// Curvature of a tag's edge between its corners, measured from the pixels next to it. The outward
/// distance of the edge from the straight line between the corners is
///   quadratic_px (w^2 - 1) + cubic_px (w^3 - w),     w = -1 at its first corner, 1 at its second.
/// The curvature is fitted together with the corners to pixels from w = -reach to reach. It is
/// unknown if reach is 0.
struct EdgeCurvature {
  double quadratic_px = 0, cubic_px = 0, reach = 0;

  double curve_offset_px(double w) const { return (w * w - 1) * (quadratic_px + cubic_px * w); }
  bool operator==(const EdgeCurvature&) const = default;
};

/// Blurred step of the light across an edge of a tag, measured in the middle of the edge. `dark`
/// and `bright` are the light on both sides, in gray levels (0 to 255) with the tone curve removed.
///
/// `blur_px` is the blur of lens and pixel together, as the sigma of the Gaussian with the same
/// MTF50, px. It is 0 if unknown. It is accurate to 3 % from 0.5 to 2 px, also for the disc of a
/// defocused lens. This requires that the stripe inside the edge is three blurs wide; in narrower
/// stripes blur_px is too small.
struct EdgeStep {
  double blur_px = 0, dark = 0, bright = 0;

  bool operator==(const EdgeStep&) const = default;
};

/// Detection of a tag in an image.
struct TagDetection {
  /// Corners in the order of BoardTag::corners_m: bottom left, bottom right, top right, top left of
  /// the black border.
  using Corners = std::array<Eigen::Vector2d, 4>;
  /// Curvatures of the edges from corner k to k + 1.
  using Curvatures = std::array<EdgeCurvature, 4>;
  /// Standard deviation of each corner in px, averaged over all directions, from the noise of the
  /// pixels that its edges are fitted to. The curvatures of the edges count as known. 0 if unknown.
  using CornerSds = std::array<double, 4>;
  /// Steps across the edges from corner k to k + 1, each from a fit of this edge alone.
  using Steps = std::array<EdgeStep, 4>;
  /// Corners and edges of a tag for one tone curve.
  struct Outline {
    Corners corners_px;
    Curvatures curvatures = {};
    CornerSds corner_sds_px = {};
    Steps steps = {};

    bool operator==(const Outline&) const = default;
  };

  int id;
  Corners corners_px;
  Curvatures curvatures = {};
  CornerSds corner_sds_px = {};
  /// Fits for the tone curves of kGammas above 1, one each, until correct_views_for_tone_curve()
  /// applies a curve. Empty for an image that certainly has no tone curve.
  std::vector<Outline> tone_curve_fits = {};
  Steps steps = {};
};

/// Detection of a point of a board's lattice: a corner where squares touch.
struct PointDetection {
  /// Index of the point on the board. Boards of squares: row by row from the top left, as OpenCV
  /// counts the corners of a ChArUco board. Boards of AprilTags, whose points come from a file: as
  /// BoardLattice::board_point_index().
  std::size_t index;
  Eigen::Vector2d pixel;
  /// Standard deviation, px, averaged over all directions: TagDetection::corner_sds_px, or of
  /// fit_edge_crossing(); 0 if unknown.
  double sd_px = 0;
  /// Factor by which a solve multiplies the residual of the point.
  double weight = 1;
};

/// Detection of a board in an image.
struct BoardDetection {
  /// Tags of the board, sorted by id, each once. For a ChArUco board its markers, accurate to 1 px.
  std::vector<TagDetection> tags;
  /// Tags of the family that the board does not have, in the order of detection. Corners are
  /// accurate to 1 to 2 px.
  std::vector<TagDetection> foreign_tags = {};
  /// Number of rejected tags of the board: detected twice, or with a corner that cannot be measured
  /// to a fraction of a pixel (at the image border, occluded, blurred, overexposed). With corner
  /// squares also tags that are only predicted from their neighbors, inside the image.
  int num_unusable_tags = 0;
  /// Number of rejected tags with more than 10 % white pixels (level 254 or 255 of 8 bits) in their
  /// bounding box.
  int num_overexposed_tags = 0;
  /// Points sorted by index, of boards of squares and from files of corners without tags.
  std::vector<PointDetection> points = {};
  /// Number of squares along width and height of the largest detected part of a chessboard. The
  /// longer side of the board comes first if it does in the board. {0, 0} if the chessboard is
  /// detected completely, if no part of it is, and for other boards.
  std::array<int, 2> largest_chessboard_part = {0, 0};
  /// Negative log-likelihood of the edges of tags for the tone curves of kGammas, up to a constant.
  /// Only the first two if the image certainly has no tone curve. Empty if no edges are fitted, or
  /// after correct_views_for_tone_curve().
  std::vector<double> curve_costs = {};

  /// Returns true if a tag or a point was detected.
  bool has_corners() const { return !tags.empty() || !points.empty(); }
};

/// Image with the detection of a board.
struct BoardView {
  /// File name of the image, without its folder.
  std::string image;
  std::array<int, 2> imager_px;
  BoardDetection detection;
};

/// Returns the corners that a calibration uses: the points, or else the corners of the tags. Their
/// indices ascend and are the same in every view.
std::vector<PointDetection> collect_detected_corners(const BoardDetection& seen);

/// Converts an image to gray levels of 8 bits. 16-bit images are scaled so that their brightest
/// pixel has level 255.
cv::Mat1b scale_to_8_bits(const cv::Mat& image);

/// Creates the decoding table of a tag family, which every detection of its tags needs (20 ms for
/// tag36h11). A process that calls it before it forks shares the table with its children.
/// @throws std::invalid_argument if there is no such family
void load_tag_family(const std::string& name);

/// Detector of a board's tags, or of the corners of its squares (SquareCorners). Safe to share
/// between threads.
///
/// AprilTags without corner squares are detected by libapriltag. The gap between tags has to be
/// white. Corners are the intersections of the tag's edges (refine_tags()), or
/// libapriltag's if their fit fails.
///
/// AprilTags with corner squares, which touch each other, are detected by OpenCV's ArUco module.
/// Missing tags are then predicted from their neighbors. Corners are the intersections of the
/// squares' edges (fit_edge_crossing()).
class BoardDetector {
 public:
  /// Creates the detector of a board.
  /// @throws std::invalid_argument if the library that detects this kind of board does not have its
  ///     family or dictionary
  explicit BoardDetector(const Board& board);
  ~BoardDetector();
  BoardDetector(const BoardDetector&) = delete;
  BoardDetector& operator=(const BoardDetector&) = delete;

  /// Detects the board in an image of 8 or 16 bits. The result depends on the image only.
  BoardDetection detect_board(const cv::Mat& image) const;

 private:
  /// Tag detector; nullptr for chessboards.
  std::unique_ptr<TagFinder> finder_;
  std::set<int> ids_;
  /// Boards of squares only.
  std::unique_ptr<SquareCorners> squares_;
  /// Boards of AprilTags without corner squares only.
  std::unique_ptr<TagGeometry> print_;
  /// Boards of AprilTags with corner squares only.
  std::unique_ptr<TouchingTags> touching_;
};

}  // namespace vlp
