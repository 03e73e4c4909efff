// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Comparison with libapriltag's images of tags.
#include "detection/boards/tag_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace vlp {
namespace {

TEST(MakeTagFamily, ReturnsEachFamilyByItsNameAndThrowsForOthers) {
  for (const std::string name :
       {"tag36h11", "tag25h9", "tag16h5", "tagCircle21h7", "tagCircle49h12", "tagCustom48h12",
        "tagStandard41h12", "tagStandard52h13"}) {
    const TagFamily family = make_tag_family(name);
    ASSERT_TRUE(family);
    EXPECT_EQ(family->name, name);
  }
  EXPECT_THROW(make_tag_family("tag36h12"), std::invalid_argument);
}

TEST(TagGeometry, WhiteBitSegmentsMatchImagesOfLibapriltag) {
  Board board;
  board.border_bits = 1;
  board.tag_spacing = 0.5;
  for (const std::string family : {"tag36h11", "tag25h9", "tag16h5"}) {
    board.family = family;
    const TagGeometry print(board);
    const TagFamily drawn = make_tag_family(family);
    const int width = drawn->width_at_border, margin = (drawn->total_width - width) / 2;
    EXPECT_EQ(print.width_of_tag_with_border_bits(), width);
    EXPECT_EQ(print.stripe_width_inside_tag_edge_bits(), 1);
    EXPECT_EQ(print.stripe_width_outside_tag_edge_bits(), 0.5 * width);
    for (const int id : {0, 5, 17}) {
      const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> picture(
          apriltag_to_image(drawn.get(), id), image_u8_destroy);
      const auto white = [&](int x, int y) {
        return picture->buf[(margin + y) * picture->stride + margin + x] > 0;
      };
      const TagGeometry::Sides sides = print.find_white_bit_segments_along_tag_edges(id);
      const int last = width - 1;
      for (int i = 0; i < width; ++i) {
        // Bottom, from the left; right, from the bottom; top, from the right; left, from the top.
        const std::array<bool, 4> expected{white(i, last - 1), white(last - 1, last - i),
                                           white(last - i, 1), white(1, i)};
        for (std::size_t k = 0; k < 4; ++k) {
          bool found = false;
          for (const TagGeometry::Segment& run : sides[k])
            found |= run.from <= i && i + 1 <= run.to;
          EXPECT_EQ(found, expected[k] && i > 0 && i < last)
              << family << id << " " << k << " " << i;
        }
      }
    }
  }
}

TEST(TagGeometry, ShiftsWhiteBitSegmentsByWidthOfBorder) {
  Board board;
  board.family = "tag36h11";
  board.border_bits = 1;
  board.tag_spacing = 1;
  const TagGeometry::Sides narrow = TagGeometry(board).find_white_bit_segments_along_tag_edges(3);
  board.border_bits = 2;
  const TagGeometry wide(board);
  EXPECT_EQ(wide.width_of_tag_with_border_bits(), 10);
  EXPECT_EQ(wide.stripe_width_inside_tag_edge_bits(), 2);
  const TagGeometry::Sides sides = wide.find_white_bit_segments_along_tag_edges(3);
  std::size_t segments = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    ASSERT_EQ(sides[k].size(), narrow[k].size());
    for (std::size_t i = 0; i < sides[k].size(); ++i) {
      EXPECT_EQ(sides[k][i].from, narrow[k][i].from + 1);
    }
    segments += sides[k].size();
  }
  EXPECT_GT(segments, 0U);
}

TEST(TagGeometry, ReturnsNoWhiteBitSegmentsForFamilyWithWhiteBorder) {
  Board board;
  board.family = "tagStandard41h12";
  board.border_bits = 1;
  board.tag_spacing = 0.3;
  const TagGeometry print(board);
  EXPECT_EQ(print.stripe_width_outside_tag_edge_bits(), 1);
  for (const auto& side : print.find_white_bit_segments_along_tag_edges(0))
    EXPECT_TRUE(side.empty());
}

/// Image of a tag with bits of 5 px, of which only the middle pixel has the level of the bit.
struct SampledTag {
  static constexpr int kBit_px = 5;

  explicit SampledTag(int border_bits, int id = 5) : border(border_bits) {
    tag.id = id;
    const int width_px = kBit_px * tag_width_with_border_in_bits(*family, border);
    levels = cv::Mat1b(width_px + 2 * margin_px, width_px + 2 * margin_px, uchar{100});
    const double low = margin_px - 0.5, high = low + width_px;
    tag.corners_px = {Eigen::Vector2d(low, high), {high, high}, {high, low}, {low, low}};
    for (uint32_t bit = 0; bit < family->nbits; ++bit) {
      level(bit) = is_tag_bit_white(*family, id, bit) ? uchar{150} : uchar{60};
    }
  }
  uchar& level(uint32_t bit) {
    const auto center = [&](uint32_t at) {
      return margin_px + kBit_px * (static_cast<int>(at) + border - 1) + kBit_px / 2;
    };
    return levels(center(family->bit_y[bit]), center(family->bit_x[bit]));
  }
  void invert(uint32_t bit) { level(bit) = static_cast<uchar>(210 - level(bit)); }
  bool matches() const { return image_matches_tag_bits(tag, levels, *family, border); }

  TagFamily family = make_tag_family("tag36h11");
  int border, margin_px = 10;
  TagDetection tag{};
  cv::Mat1b levels;
};

TEST(ImageMatchesTagBits, SamplesCentersOfBits) {
  for (const int border_bits : {1, 2}) {
    SampledTag sampled(border_bits);
    EXPECT_TRUE(sampled.matches()) << border_bits;
    ++sampled.tag.id;
    EXPECT_FALSE(sampled.matches()) << border_bits;
  }
}

TEST(ImageMatchesTagBits, ReturnsFalseForRotatedCorners) {
  SampledTag sampled(1);
  std::rotate(sampled.tag.corners_px.begin(), sampled.tag.corners_px.begin() + 1,
              sampled.tag.corners_px.end());
  EXPECT_FALSE(sampled.matches());
}

TEST(ImageMatchesTagBits, ToleratesTwoWrongBits) {
  SampledTag sampled(1);
  sampled.invert(0);
  sampled.invert(17);
  EXPECT_TRUE(sampled.matches());
  sampled.invert(35);
  EXPECT_FALSE(sampled.matches());
}

/// A black bit between white ones is gray in overexposed and blurred images.
TEST(ImageMatchesTagBits, ThresholdIsBetweenMeansOfWhiteAndBlackBits) {
  SampledTag sampled(1);
  std::vector<uint32_t> black;
  for (uint32_t bit = 0; bit < sampled.family->nbits; ++bit) {
    if (!is_tag_bit_white(*sampled.family, sampled.tag.id, bit)) black.push_back(bit);
  }
  ASSERT_GT(black.size(), 4U);
  // The level x of three bits equals the threshold (150 + 60 + 3 (x - 60) / n) / 2.
  const auto n = static_cast<double>(black.size());
  const double limit = (105 - 90 / n) / (1 - 1.5 / n);
  for (std::size_t i = 0; i < 3; ++i) sampled.level(black[i]) = static_cast<uchar>(limit - 1);
  EXPECT_TRUE(sampled.matches());
  for (std::size_t i = 0; i < 3; ++i) sampled.level(black[i]) = static_cast<uchar>(limit + 2);
  EXPECT_FALSE(sampled.matches());
}

// The bits begin one bit inside the corners.
TEST(ImageMatchesTagBits, ReturnsFalseIfBitIsOutsideImage) {
  const SampledTag sampled(1);
  const int first = sampled.margin_px + SampledTag::kBit_px + 2,
            last = sampled.levels.cols - 1 - first;
  const auto matches = [&](int left, int top, int right, int bottom) {
    SampledTag part(1);
    part.levels = sampled.levels(cv::Range(top, bottom + 1), cv::Range(left, right + 1)).clone();
    for (auto& corner : part.tag.corners_px) corner -= Eigen::Vector2d(left, top);
    return part.matches();
  };
  EXPECT_TRUE(matches(first, first, last, last));
  EXPECT_FALSE(matches(first + 1, first, last, last));
  EXPECT_FALSE(matches(first, first + 1, last, last));
  EXPECT_FALSE(matches(first, first, last - 1, last));
  EXPECT_FALSE(matches(first, first, last, last - 1));
}

/// Layout of tags in a row, with the given distances from its beginning.
struct TagRow {
  explicit TagRow(const std::vector<double>& distances_m) {
    for (const double at_m : distances_m) {
      const int id = static_cast<int>(layout.size());
      BoardTag place{id, {}};
      TagDetection tag{id, {}};
      for (std::size_t k = 0; k < 4; ++k) {
        place.corners_m[k] = {at_m, double(k)};
        tag.corners_px[k] = {100 * at_m, 10 * double(k)};
      }
      layout.push_back(place);
      tags.push_back(tag);
    }
  }
  NearestCorners find(double max_distance_m) const {
    return find_nearest_tag_corners(tags, layout, max_distance_m, [](const BoardTag& tag) {
      return std::abs(tag.corners_m[0].x());
    });
  }

  std::vector<BoardTag> layout;
  std::vector<TagDetection> tags;
};

TEST(FindNearestTagCorners, ReturnsCornersOfTagsBelowMaximumDistance) {
  const TagRow row({3, 2, 1, 5});
  const NearestCorners nearest = row.find(3);
  EXPECT_EQ(nearest.distance_m, 1);
  ASSERT_EQ(nearest.pairs.size(), 8U);
  for (std::size_t i = 0; i < 8; ++i) {
    const double expected_m = i < 4 ? 1 : 2;
    EXPECT_EQ(nearest.pairs[i].from, Eigen::Vector2d(expected_m, double(i % 4)));
    EXPECT_EQ(nearest.pairs[i].to, Eigen::Vector2d(100 * expected_m, 10 * double(i % 4)));
  }
}

TEST(FindNearestTagCorners, ReturnsFourNearestTags) {
  const NearestCorners nearest = TagRow({6, 1, 5, 2, 3, 4}).find(100);
  ASSERT_EQ(nearest.pairs.size(), 16U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(nearest.pairs[4 * i].from.x(), double(i + 1));
}

TEST(FindNearestTagCorners, PrefersSmallerIdsAtEqualDistance) {
  TagRow row({1, -1, 1, -1, 1});
  std::reverse(row.tags.begin(), row.tags.end());
  const NearestCorners nearest = row.find(2);
  ASSERT_EQ(nearest.pairs.size(), 16U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(nearest.pairs[4 * i].from.x(), i % 2 == 0 ? 1 : -1) << i;
  }
}

TEST(FindNearestTagCorners, HasInfiniteDistanceWithoutTags) {
  const NearestCorners nearest = TagRow({4, 5}).find(3);
  EXPECT_TRUE(nearest.pairs.empty());
  EXPECT_EQ(nearest.distance_m, INFINITY);
}

}  // namespace
}  // namespace vlp
