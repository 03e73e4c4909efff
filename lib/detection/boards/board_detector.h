// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "rig/board.h"

namespace vlp {

class TagFinder;
class TagPrint;
class TouchingTags;
class SquareCorners;
struct GreyLevels;

/// How an edge of a tag bows between its corners, as the pixels beside it show it: outwards of the
/// straight line by
///   square_px (w^2 - 1) + cube_px (w^3 - w),     w = -1 at its first corner, 1 at its second,
/// fitted together with the corners to pixels from -reach to reach. With reach 0 nobody knows.
struct EdgeBow {
  double square_px = 0, cube_px = 0, reach = 0;

  double at(double w) const { return (w * w - 1) * (square_px + cube_px * w); }
  bool operator==(const EdgeBow&) const = default;
};

/// Step of the light across an edge of a tag: blur of lens and pixel together, as the sigma of the
/// Gaussian that has the same MTF50, and the light on both sides in the middle of the edge, in
/// levels behind no tone curve. A blur of 0 is unknown.
/// The blur is accurate to 3 % from 0.5 to 2 px, also of a disc of defocus, if the stripe inside
/// the edge is three blurs wide. In narrower stripes it is too small.
struct EdgeStep {
  double blur_px = 0, dark = 0, bright = 0;

  bool operator==(const EdgeStep&) const = default;
};

/// A tag as an image shows it.
struct SeenTag {
  /// As BoardTag::corners_m: bottom left, bottom right, top right, top left of the black border.
  using Corners = std::array<Eigen::Vector2d, 4>;
  /// Of the edges from corner k to k + 1.
  using Bows = std::array<EdgeBow, 4>;
  /// Of a corner, along any direction in the mean, by the noise of the pixels that its edges are
  /// fitted to, with their bows known; 0 where nobody knows.
  using Deviations = std::array<double, 4>;
  /// Steps across the edges from corner k to k + 1, each from a fit of this edge alone.
  using Steps = std::array<EdgeStep, 4>;
  struct Outline {
    Corners corners_px;
    Bows bows = {};
    Deviations sds_px = {};
    Steps steps = {};

    bool operator==(const Outline&) const = default;
  };

  int id;
  Corners corners_px;
  Bows bows = {};
  Deviations sds_px = {};
  /// The same behind tone curves of kGammas beyond 1, until one is taken (take_curve()); of
  /// an image that has none for sure there are none.
  std::vector<Outline> behind_curves = {};
  Steps steps = {};
};

/// A point of a board's lattice as an image shows it: a corner in which squares touch.
struct SeenPoint {
  /// Of boards of squares row by row from the top left, as OpenCV counts a ChArUco board's corners;
  /// of boards of AprilTags, whose points come from a file, as BoardLattice::index_of() does.
  std::size_t index;
  Eigen::Vector2d pixel;
  /// What its residual is multiplied by.
  double weight = 1;
};

/// What of a board an image shows.
struct SeenBoard {
  /// By id, each once; of a ChArUco board its markers, to a pixel.
  std::vector<SeenTag> tags;
  /// Tags of the family that the board does not have, in the order found; corners to 1 or 2 px.
  std::vector<SeenTag> foreign = {};
  /// Tags of the board that are left out: seen twice, or with a corner that cannot be found to a
  /// fraction of a pixel (at the image's edge, hidden, blurred away, overexposed).
  int unusable = 0;
  /// Of these, tags with a tenth of their pixels or more at the image's brightest level, white.
  int overexposed = 0;
  /// Of boards of squares, and from files that hold corners without their tags: by index.
  std::vector<SeenPoint> points = {};
  /// Minus the logarithm of the likelihood of what edges of tags show behind curves of kGammas, up
  /// to a constant: of the first two where there is no curve for sure. Empty where no edges are
  /// fitted, and when a curve is taken.
  std::vector<double> curve_costs = {};

  /// Whether there is something to calibrate from.
  bool any() const { return !tags.empty() || !points.empty(); }
};

/// The corners that a calibration rests on, by a number that is the same in every view, rising.
std::vector<SeenPoint> corners_of(const SeenBoard& seen);

/// Grey levels of 8 bits; of 16 bits with the brightest at 255.
cv::Mat1b eight_bits(const cv::Mat& image);

/// Makes what finding the tags of a family takes anyway, 20 ms for tag36h11: in a process before
/// others are split off, which share it. Throws std::invalid_argument.
void prepare_tag_family(const std::string& name);

/// Finds a board's tags, or the corners of its squares (SquareCorners). Boards of AprilTags without
/// corner squares by libapriltag, with corners where the
/// tag's edges cross (find_exact_edges()), or its own where that fails; the gap between tags has to
/// be white. Boards with corner squares, where tags touch, by OpenCV's ArUco module and from one to
/// the next, with corners where the squares' edges cross (edge_crossing()). Safe to share between
/// threads.
class BoardDetector {
 public:
  /// Throws std::invalid_argument when the detector that the board needs lacks the family or the
  /// dictionary.
  explicit BoardDetector(const Board& board);
  ~BoardDetector();
  BoardDetector(const BoardDetector&) = delete;
  BoardDetector& operator=(const BoardDetector&) = delete;

  /// image: grey levels of 8 or 16 bits. The result depends on the image only.
  SeenBoard detect(const cv::Mat& image) const;

 private:
  /// With exact corners; nothing when they cannot be found.
  std::optional<SeenTag> exact(const SeenTag& tag, const GreyLevels& image) const;

  SeenBoard seen_squares(const cv::Mat1b& levels) const;

  /// None of chessboards.
  std::unique_ptr<TagFinder> finder_;
  std::set<int> ids_;
  /// Of boards of squares.
  std::unique_ptr<SquareCorners> squares_;
  /// Of boards without corner squares.
  std::unique_ptr<TagPrint> print_;
  /// Of boards with corner squares.
  std::unique_ptr<TouchingTags> touching_;
};

}  // namespace vlp
