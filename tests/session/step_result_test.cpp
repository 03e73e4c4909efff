// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/step_result.h"

#include <gmock/gmock.h>

#include <array>
#include <string>

namespace vlp {
namespace {

using testing::ElementsAre;

Observation rejected(const char* file, RejectionReason reason, const char* message) {
  Observation image{file};
  image.reject(reason, message);
  return image;
}

std::vector<std::string> lines(const std::vector<SkippedImage>& skipped) {
  std::vector<std::string> lines;
  for (const auto& [image, reason] : skipped) lines.push_back(image + ": " + reason);
  return lines;
}

TEST(ListSkippedImages, OmitsFolderFromNamesInSingleFolder) {
  EXPECT_THAT(
      lines(list_skipped_images({Observation{"f/a.png"},
                                 rejected("f/b.png", RejectionReason::unreadable, "is empty"),
                                 rejected("f/c.png", RejectionReason::blurred, "is 3: large")})),
      ElementsAre("b.png: is empty", "c.png: is 3: large"));
}

TEST(ListSkippedImages, NamesFoldersWhenThereAreSeveral) {
  EXPECT_THAT(
      lines(list_skipped_images(
          {Observation{"f/a.png"}, rejected("g/a.png", RejectionReason::unreadable, "is empty")})),
      ElementsAre("g/a.png: is empty"));
}

TEST(AddIntakeRemarks, CombinesRejectedFramesOfVideoByReason) {
  Observations seen;
  seen.images = {rejected("a.png", RejectionReason::too_few_corners, "shows 1 tag"),
                 rejected("b.avi#000000", RejectionReason::too_few_corners, "shows 2 tags"),
                 rejected("b.avi#000003", RejectionReason::too_few_corners, "shows 3 tags"),
                 rejected("c.avi#000000", RejectionReason::too_few_corners, "shows 2 tags"),
                 rejected("b.avi#000004", RejectionReason::same_view, "is as #000003")};
  StepResult result;
  add_intake_remarks(seen, result);
  EXPECT_TRUE(result.has_succeeded());
  EXPECT_THAT(
      lines(result.skipped),
      ElementsAre("a.png: shows 1 tag", "b.avi: 2 of its frames: with too little of the board",
                  "c.avi: 1 of its frames: with too little of the board",
                  "b.avi: 1 of its frames: the same view again"));
  EXPECT_THAT(result.details,
              ElementsAre("b.avi#000000: shows 2 tags", "b.avi#000003: shows 3 tags",
                          "c.avi#000000: shows 2 tags", "b.avi#000004: is as #000003"));
}

TEST(AddIntakeRemarks, WarnsOfNumberAndFirstThreeNamesOfDoubtfulImages) {
  const std::array expected{
      "a.png: 9 outliers", "2 doubtful images are used (a.png, b.png), the first: 9 outliers",
      "3 doubtful images are used (a.png, b.png, c.png), the first: 9 outliers",
      "4 doubtful images are used (a.png, b.png, c.png, ...), the first: 9 outliers"};
  Observations seen;
  seen.images = {Observation{"f/good.png"},
                 rejected("f/bad.png", RejectionReason::blurred, "blurred")};
  seen.images.back().doubt = "overexposed";
  for (std::size_t i = 0; i < expected.size(); ++i) {
    seen.images.push_back(Observation{std::string("f/") + "abcd"[i] + ".png"});
    seen.images.back().doubt = i == 0 ? "9 outliers" : "overexposed";
    StepResult result;
    add_intake_remarks(seen, result);
    EXPECT_THAT(result.warnings, ElementsAre(expected[i]));
  }
}

TEST(AddIntakeRemarks, CopiesFailureAndPrependsWarnings) {
  Observations seen;
  seen.warnings = {"dark"};
  seen.failure = {true, "shows another board", "board.yaml"};
  StepResult result;
  result.warnings = {"later"};
  add_intake_remarks(seen, result);
  EXPECT_EQ(result.failure, StepFailure::wrong_board);
  EXPECT_EQ(result.file_to_correct, "board.yaml");
  EXPECT_THAT(result.warnings, ElementsAre("dark", "later"));
}

}  // namespace
}  // namespace vlp
