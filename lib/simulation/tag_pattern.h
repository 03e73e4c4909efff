// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// Printed bits of one AprilTag, in the orientation in which libapriltag renders it.
struct TagPattern {
  /// Number of bits along an edge of the black border's square, which is tag_size_m wide.
  int border_width;
  /// Number of bits outside that square on each side (families whose border is white inside).
  int outside;
  /// Bits row by row from the top left, width() along an edge; true is white.
  std::vector<bool> white;

  int width() const { return border_width + 2 * outside; }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width()) +
           static_cast<std::size_t>(column);
  }
};

/// Returns the pattern of a tag.
/// @throws std::invalid_argument if the family has no such id, or if border_bits is 2 for a family
/// without a plain black border
TagPattern make_tag_pattern(const std::string& family, int id, int border_bits);

}  // namespace vlp
