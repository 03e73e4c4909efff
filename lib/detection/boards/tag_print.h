// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "detection/boards/tag_families.h"
#include "rig/board.h"

namespace vlp {

/// What is printed beside the edges of a board's tags, in bits, from a tag's edge.
class TagPrint {
 public:
  /// From and to, along a side from its first corner.
  struct Run {
    double from, to;
  };
  /// Of the sides from corner k to k + 1, as SeenTag has them.
  using Sides = std::array<std::vector<Run>, 4>;

  /// Throws std::invalid_argument for a family that libapriltag lacks.
  explicit TagPrint(const Board& board);

  double width() const { return width_; }
  /// How wide the stripes of one colour along an edge are.
  double inside() const { return inside_; }
  double outside() const { return outside_; }
  /// Where white bits follow upon the black stripe inside; none of families whose border is white.
  Sides white_behind(int id) const;

 private:
  TagFamily family_;
  double width_, inside_, outside_;
};

}  // namespace vlp
