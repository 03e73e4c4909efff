// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Comparison with libapriltag's images of tags.
#include "detection/boards/tag_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

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
    EXPECT_EQ(print.width_bits(), width);
    EXPECT_EQ(print.inner_stripe_bits(), 1);
    EXPECT_EQ(print.outer_stripe_bits(), 0.5 * width);
    for (const int id : {0, 5, 17}) {
      const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> picture(
          apriltag_to_image(drawn.get(), id), image_u8_destroy);
      const auto white = [&](int x, int y) {
        return picture->buf[(margin + y) * picture->stride + margin + x] > 0;
      };
      const TagGeometry::Sides sides = print.list_white_segments(id);
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
  const TagGeometry::Sides narrow = TagGeometry(board).list_white_segments(3);
  board.border_bits = 2;
  const TagGeometry wide(board);
  EXPECT_EQ(wide.width_bits(), 10);
  EXPECT_EQ(wide.inner_stripe_bits(), 2);
  const TagGeometry::Sides sides = wide.list_white_segments(3);
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

}  // namespace
}  // namespace vlp
