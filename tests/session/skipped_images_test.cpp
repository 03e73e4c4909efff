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

TEST(NothingUsable, TellsTheFirstReason) {
  StepResult result;
  result.skipped = {{"a.png", "is cut short"}, {"b.png", "is empty"}};
  EXPECT_STREQ(nothing_usable("f", 2, result).what(),
               "f: none of its 2 images can be used; the first, a.png: is cut short");
}

}  // namespace
}  // namespace vlp
