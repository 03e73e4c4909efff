// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "detection/boards/tag_families.h"
#include "rig/board.h"

namespace vlp {

/// Printed pattern next to the edges of a board's tags, in bits.
class TagGeometry {
 public:
  /// Segment along a side; distances from the first corner of the side.
  struct Segment {
    double from, to;
  };
  /// Segments of each side, from corner k to k + 1 in the order of TagDetection.
  using Sides = std::array<std::vector<Segment>, 4>;

  /// @throws std::invalid_argument if libapriltag does not have the family
  explicit TagGeometry(const Board& board);

  /// Width of a tag, with its border.
  double width() const { return width_; }
  /// Width of the uniform stripe along an edge, inside and outside the tag.
  double inside() const { return inside_; }
  double outside() const { return outside_; }
  /// Returns the segments in which white bits adjoin the black stripe inside the edge. Empty for
  /// families with a white border.
  Sides find_white_segments(int id) const;

 private:
  TagFamily family_;
  double width_, inside_, outside_;
};

}  // namespace vlp
