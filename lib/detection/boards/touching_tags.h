// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "detection/boards/board_detector.h"
#include "detection/boards/saddle_point.h"
#include "detection/boards/tag_families.h"
#include "rig/board_layout.h"

namespace vlp {

/// The exact corners of tags that black squares touch, and the tags that were not found at first.
class TouchingTags {
 public:
  explicit TouchingTags(const Board& board);

  /// The tag with its corners where edges cross near the saddle points near them; nothing when one
  /// is not found, or when the bits between them are not the tag's.
  std::optional<SeenTag> exact(SeenTag tag, const GreyLevels& image) const;

  /// The tags of the board that are not among `tags`, which are exact, but lie where a homography
  /// of the nearest of these takes them, as far as they can be made exact.
  std::vector<SeenTag> others(const std::vector<SeenTag>& tags, const GreyLevels& image) const;

 private:
  std::optional<SeenTag> expected(const BoardTag& missing, const std::vector<SeenTag>& tags) const;

  std::vector<BoardTag> layout_;
  TagFamily family_;
  int border_bits_;
  double tag_size_m_;
  /// Of a tag's edge: the width of a corner square or of the black border, what is less.
  double free_share_;
};

}  // namespace vlp
