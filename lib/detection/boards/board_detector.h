// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <vector>

#include "rig/board.h"

namespace vlp {

class TagFinder;
struct EdgeStripes;
class TouchingTags;
struct GreyLevels;

/// A tag as an image shows it.
struct SeenTag {
  int id;
  /// As BoardTag::corners_m: bottom left, bottom right, top right, top left of the black border.
  std::array<Eigen::Vector2d, 4> corners_px;
};

/// What of a board an image shows.
struct SeenBoard {
  /// By id, each once.
  std::vector<SeenTag> tags;
  /// Tags of the family that the board does not have, in the order found; corners to 1 or 2 px.
  std::vector<SeenTag> foreign = {};
  /// Tags of the board that are left out: seen twice, or with a corner that cannot be found to a
  /// fraction of a pixel (at the image's edge, hidden, blurred away, overexposed).
  int unusable = 0;
  /// Of these, tags with a tenth of their pixels or more at the image's brightest level, white.
  int overexposed = 0;
};

/// Finds a board's tags. Boards without corner squares by libapriltag, with corners where the
/// tag's edges cross (with_exact_edges()), or its own where that fails; the gap between tags has to
/// be white. Boards with corner squares, where tags touch, by OpenCV's ArUco module and from one to
/// the next, with corners where the squares' edges cross (edge_crossing()). Safe to share between
/// threads.
class BoardDetector {
 public:
  /// Throws std::invalid_argument when the detector that the board needs lacks the family.
  explicit BoardDetector(const Board& board);
  ~BoardDetector();
  BoardDetector(const BoardDetector&) = delete;
  BoardDetector& operator=(const BoardDetector&) = delete;

  /// image: grey levels of 8 or 16 bits. The result depends on the image only.
  SeenBoard detect(const cv::Mat& image) const;

 private:
  /// With exact corners; nothing when they cannot be found.
  std::optional<SeenTag> exact(const SeenTag& tag, const GreyLevels& image) const;

  std::unique_ptr<TagFinder> finder_;
  std::set<int> ids_;
  /// Of boards without corner squares.
  std::unique_ptr<EdgeStripes> stripes_;
  /// Of boards with corner squares.
  std::unique_ptr<TouchingTags> touching_;
};

}  // namespace vlp
