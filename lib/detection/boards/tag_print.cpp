// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_print.h"

namespace vlp {

TagGeometry::TagGeometry(const Board& board)
    : family_(make_tag_family(board.family)),
      width_(width_in_bits(*family_, board.border_bits)),
      inside_(board.border_bits),
      outside_(family_->reversed_border ? 1 : board.tag_spacing * width_) {}

TagGeometry::Sides TagGeometry::find_white_segments(int id) const {
  Sides sides;
  if (family_->reversed_border) return sides;
  const int last = static_cast<int>(width_) - 1, border = static_cast<int>(inside_);
  for (uint32_t bit = 0; bit < family_->nbits; ++bit) {
    if (!is_white(*family_, id, bit)) continue;
    const int x = static_cast<int>(family_->bit_x[bit]) + border - 1;  // from the top left
    const int y = static_cast<int>(family_->bit_y[bit]) + border - 1;
    const std::array<int, 4> along{x, last - y, last - x, y}, deep{last - y, last - x, y, x};
    for (std::size_t k = 0; k < 4; ++k) {
      if (deep[k] == border) sides[k].push_back({double(along[k]), double(along[k] + 1)});
    }
  }
  return sides;
}

}  // namespace vlp
