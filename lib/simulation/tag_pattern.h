// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// The printed bits of one AprilTag, upright as libapriltag draws it.
struct TagPattern {
  /// Bits along an edge of the black border's square, which is tag_size_m wide.
  int border_width;
  /// Bits that stand out of that square on each side (families whose border is white inside).
  int outside;
  /// Row by row from the top left, border_width + 2 outside along an edge; true is white.
  std::vector<bool> white;

  int width() const { return border_width + 2 * outside; }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width()) +
           static_cast<std::size_t>(column);
  }
};

/// Throws std::invalid_argument when the family has no such id, or when border_bits is 2 for a
/// family that has no plain black border.
TagPattern tag_pattern(const std::string& family, int id, int border_bits);

}  // namespace vlp
