// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/boards/edge_crossing.h"
#include "detection/boards/tag_pattern.h"
#include "rig/board_layout.h"

namespace vlp {

/// Refinement of tags whose corners touch black squares, and detection of tags that the first
/// detector missed.
class TouchingTags {
 public:
  explicit TouchingTags(const Board& board);

  /// Returns the tag with refined corners: the intersections of the edges next to the saddle points
  /// at its corners, or the saddle points. Returns std::nullopt if a saddle point is not found, or
  /// if the bits between the corners are not those of the tag.
  std::optional<TagDetection> exact(TagDetection tag, const GrayLevels& image) const;

  /// Finds tags of the board that are missing in `tags`, which are refined. Predicts their position
  /// by a homography of the nearest tags. Returns those that exact() accepts.
  std::vector<TagDetection> find_missing(const std::vector<TagDetection>& tags,
                                         const GrayLevels& image) const;

 private:
  std::optional<TagDetection> predict(const BoardTag& missing,
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
