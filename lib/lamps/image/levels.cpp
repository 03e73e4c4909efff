// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/image/levels.h"

#include <algorithm>

namespace vlp {

int brightest_level(const ImageView& image) {
  return visit_levels(image, [&](auto level) {
    auto brightest = level;
    for (int y = 0; y < image.height; ++y) {
      const auto* row = image.row<decltype(level)>(y);
      for (int x = 0; x < image.width; ++x) brightest = std::max(brightest, row[x]);
    }
    return int{brightest};
  });
}

int count_pixels_at(const ImageView& image, int level) {
  return visit_levels(image, [&](auto type) {
    int count = 0;
    for (int y = 0; y < image.height; ++y) {
      const auto* row = image.row<decltype(type)>(y);
      count += static_cast<int>(std::count(row, row + image.width, level));
    }
    return count;
  });
}

}  // namespace vlp
