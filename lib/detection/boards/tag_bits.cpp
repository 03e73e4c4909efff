// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_bits.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace vlp {

bool matches_tag_bits(const TagDetection& tag, const cv::Mat1f& levels,
                      const apriltag_family_t& family, int border_bits) {
  constexpr int max_wrong = 2;
  const double width = width_in_bits(family, border_bits);
  const std::array<Eigen::Vector2d, 4> square{{{0, width}, {width, width}, {width, 0}, {0, 0}}};
  std::array<PlanePair, 4> pairs;
  for (std::size_t k = 0; k < 4; ++k) pairs[k] = {square[k], tag.corners_px[k]};
  const Eigen::Matrix3d px_from_bits = estimate_homography(pairs);
  std::vector<float> seen(family.nbits);
  for (uint32_t bit = 0; bit < family.nbits; ++bit) {
    const double middle = border_bits - 0.5;
    const Eigen::Vector2d at =
        (px_from_bits * Eigen::Vector3d(family.bit_x[bit] + middle, family.bit_y[bit] + middle, 1))
            .hnormalized();
    const int column = static_cast<int>(std::lround(at.x()));
    const int row = static_cast<int>(std::lround(at.y()));
    if (column < 0 || row < 0 || column >= levels.cols || row >= levels.rows) return false;
    seen[bit] = levels(row, column);
  }
  const auto [darkest, brightest] = std::minmax_element(seen.begin(), seen.end());
  const float threshold = (*darkest + *brightest) / 2;
  int wrong = 0;
  for (uint32_t bit = 0; bit < family.nbits; ++bit) {
    wrong += is_white(family, tag.id, bit) != (seen[bit] > threshold);
  }
  return wrong <= max_wrong;
}

}  // namespace vlp
