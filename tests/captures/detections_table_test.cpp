// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/detections_table.h"

#include <gmock/gmock.h>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class ReadDetections : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::vector<Frame> read(const std::string& content) {
    return read_detections(folder.file("d.csv", content));
  }
  std::string refusal(const std::string& content) {
    return rejection_message([&] { read(content); });
  }
};

TEST_F(ReadDetections, GroupsRowsByImageInOrderOfAppearance) {
  const auto frames = read("image,lamp,u_px,v_px\nb,2,10,20\na,1,1.5,-2\nb,1,3,4\n");
  ASSERT_EQ(frames.size(), 2);
  EXPECT_EQ(frames[0].image, "b");
  ASSERT_EQ(frames[0].detections.size(), 2);
  ASSERT_EQ(frames[1].detections.size(), 1);
  EXPECT_EQ(frames[0].detections[1].lamp, 1);
  EXPECT_EQ(frames[0].detections[1].pixel, Eigen::Vector2d(3, 4));
  EXPECT_EQ(frames[1].detections[0].pixel, Eigen::Vector2d(1.5, -2));
  EXPECT_FALSE(frames[0].detections[0].sigma_px);
}

TEST_F(ReadDetections, ReturnsSigmaOnlyForRowsThatContainIt) {
  const auto frames = read("lamp,sigma_px,image,v_px,u_px,note\n1,0.05,a,2,1,x\n2,,a,4,3,y\n");
  ASSERT_EQ(frames.size(), 1);
  ASSERT_EQ(frames[0].detections.size(), 2);
  EXPECT_EQ(frames[0].detections[0].sigma_px, 0.05);
  EXPECT_FALSE(frames[0].detections[1].sigma_px);
}

TEST_F(ReadDetections, ReturnsDetectionsWrittenByWriteDetections) {
  const std::vector<Frame> frames{{"a, b.png", {{3, {1.25, -7.5}, 0.05}, {4, {100, 200}, {}}}},
                                  {"c.png", {{3, {0.0625, 2}, 1.5}}}};
  write_detections(folder / "e.csv", frames);
  const auto again = read_detections(folder / "e.csv");
  ASSERT_EQ(again.size(), 2);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again[i].image, frames[i].image);
    ASSERT_EQ(again[i].detections.size(), frames[i].detections.size());
    for (std::size_t k = 0; k < frames[i].detections.size(); ++k) {
      EXPECT_EQ(again[i].detections[k].lamp, frames[i].detections[k].lamp);
      EXPECT_EQ(again[i].detections[k].pixel, frames[i].detections[k].pixel);
      EXPECT_EQ(again[i].detections[k].sigma_px, frames[i].detections[k].sigma_px);
    }
  }
}

TEST_F(ReadDetections, ReportsFileLineAndColumnOfInvalidInput) {
  const std::string header = "image,lamp,u_px,v_px,sigma_px\n";
  EXPECT_THAT(refusal("image,lamp,u,v\na,1,2,3\n"),
              HasSubstr("d.csv:1: u_px: this column is missing"));
  EXPECT_THAT(refusal(header + "a,one,2,3,1\n"),
              HasSubstr("d.csv:2: lamp: should be a whole number"));
  EXPECT_THAT(refusal(header + "a,1,2,nan,1\n"), HasSubstr("d.csv:2: v_px: should be a finite"));
  EXPECT_THAT(refusal(header + "a,1,2,3,0\n"),
              HasSubstr("d.csv:2: sigma_px: should be within 0.0001 and 1000 px"));
  EXPECT_THAT(refusal(header + ",1,2,3,1\n"), HasSubstr("d.csv:2: image: is empty"));
  EXPECT_THAT(refusal(header + "a,1,2,3,1\nb,1,2,3,1\na,1,5,6,1\n"),
              HasSubstr("d.csv:4: lamp: 1 occurs twice in image 'a'"));
  EXPECT_THAT(refusal(header), HasSubstr("d.csv: contains no detection"));
}

}  // namespace
}  // namespace vlp
