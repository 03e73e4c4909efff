// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/skipped_images.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

TEST(SkippedImages, AreNamedWithoutTheirFolder) {
  const auto skipped = skipped_images({"f/a.png", "f/b.png", "f/c.png"},
                                      {"f/b.png: is empty", "f/c.png: is 3: large"});
  ASSERT_EQ(skipped.size(), 2u);
  EXPECT_EQ(skipped[0].image, "b.png");
  EXPECT_EQ(skipped[0].reason, "is empty");
  EXPECT_EQ(skipped[1].reason, "is 3: large");
}

TEST(SkippedImages, OfSeveralFoldersKeepTheirs) {
  const auto skipped = skipped_images({"f/a.png", "g/a.png"}, {"g/a.png: is empty"});
  EXPECT_EQ(skipped[0].image, "g/a.png");
}

TEST(SkippedViews, TellOfTheFramesOfAVideoTogether) {
  SkippedViews skipped;
  skipped.add("a.png", "shows 1 tag", "show too little");
  for (const char* frame : {"b.avi#000000", "b.avi#000003", "c.avi#000000"}) {
    skipped.add(frame, "shows 2 tags", "show too little");
  }
  skipped.add("b.avi#000004", "is as #000003", "are alike");
  StepResult result;
  skipped.tell(result);
  std::vector<std::string> lines;
  for (const auto& [image, reason] : result.skipped) lines.push_back(image + ": " + reason);
  EXPECT_THAT(lines,
              testing::ElementsAre("a.png: shows 1 tag", "b.avi: 2 of its frames show too little",
                                   "c.avi: 1 of its frames show too little",
                                   "b.avi: 1 of its frames are alike"));
  EXPECT_THAT(result.details,
              testing::ElementsAre("b.avi#000000: shows 2 tags", "b.avi#000003: shows 2 tags",
                                   "c.avi#000000: shows 2 tags", "b.avi#000004: is as #000003"));
}

TEST(NothingUsable, TellsTheFirstReason) {
  StepResult result;
  result.skipped = {{"a.png", "is cut short"}, {"b.png", "is empty"}};
  EXPECT_STREQ(nothing_usable("f", 2, result).what(),
               "f: none of its 2 images can be used; the first, a.png: is cut short");
}

}  // namespace
}  // namespace vlp
