// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Narrow tags, computed analytically with their bits, which are blurred into the edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "detection/boards/tag_edges.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Rotated tag of the family tag36h11 on white.
struct NarrowTag {
  int id = 3;
  double bit_px = 3.1, angle_rad = 0.25, blur_px = 0.8, dark = 40, bright = 190;
  Eigen::Vector2d center{40.3, 38.7};

  Eigen::Matrix2d image_from_tag() const {
    Eigen::Matrix2d rotation;
    rotation << std::cos(angle_rad), -std::sin(angle_rad), std::sin(angle_rad), std::cos(angle_rad);
    return rotation;
  }
  /// Returns the fraction of a pixel covered by the rectangle from `low` to `high`, in bits from
  /// the center of the tag.
  double compute_coverage(const Eigen::Vector2d& in_tag_px, const Eigen::Vector2d& low,
                          const Eigen::Vector2d& high) const {
    double coverage = 1;
    for (const Eigen::Index i : {0, 1}) {
      const auto cdf = [&](double edge) {
        return std::erfc((edge * bit_px - in_tag_px[i]) / (std::numbers::sqrt2 * blur_px)) / 2;
      };
      coverage *= cdf(low[i]) - cdf(high[i]);
    }
    return coverage;
  }
  cv::Mat1b render() const {
    const TagFamily family = make_tag_family("tag36h11");
    const double half = family->width_at_border / 2.0;
    cv::Mat1b image(80, 84);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        const Eigen::Vector2d at =
            image_from_tag().transpose() * (Eigen::Vector2d(column, row) - center);
        const Eigen::Vector2d corner = Eigen::Vector2d::Constant(half);
        double black = compute_coverage(at, -corner, corner);
        for (uint32_t bit = 0; bit < family->nbits; ++bit) {
          if (!is_tag_bit_white(*family, id, bit)) continue;
          const Eigen::Vector2d low(family->bit_x[bit] - half, family->bit_y[bit] - half);
          black -= compute_coverage(at, low, low + Eigen::Vector2d(1, 1));
        }
        image(row, column) = cv::saturate_cast<uchar>(bright - (bright - dark) * black);
      }
    }
    return image;
  }
  TagDetection::Corners corners_px() const {
    const double half_px = 4 * bit_px;
    TagDetection::Corners corners{Eigen::Vector2d(-half_px, half_px),
                                  {half_px, half_px},
                                  {half_px, -half_px},
                                  {-half_px, -half_px}};
    for (auto& corner : corners) corner = center + image_from_tag() * corner;
    return corners;
  }
};

TEST(RefineTags, BitsDoNotDisplaceCornersOfNarrowTags) {
  const Board board{"tag36h11", 1, 1, 0.1, 0.6, 1, false, 0, {false, BoardCorner::top_left}};
  for (const int id : {3, 100, 371}) {
    for (const double angle_rad : {0.25, 1.9, -2.4}) {
      for (const double bit_px : {2.3, 3.1}) {
        SCOPED_TRACE(testing::Message() << id << " " << angle_rad << " " << bit_px);
        const NarrowTag tag{.id = id, .bit_px = bit_px, .angle_rad = angle_rad};
        std::vector<TagDetection> tags{{id, tag.corners_px()}};
        for (auto& corner : tags[0].corners_px) corner += Eigen::Vector2d(0.15, -0.1);
        refine_tags(tags, tag.render(), TagGeometry(board));
        for (std::size_t k = 0; k < 4; ++k) {
          EXPECT_THAT(tags[0].corners_px[k], IsNear(tag.corners_px()[k], 0.025)) << k;
          EXPECT_NEAR(tags[0].steps[k].blur_px, tag.blur_px, 0.03) << k;
          EXPECT_NEAR(tags[0].steps[k].bright, tag.bright, 1) << k;
          EXPECT_NEAR(tags[0].steps[k].dark, tag.dark, 3) << k;
        }
      }
    }
  }
}

}  // namespace
}  // namespace vlp
