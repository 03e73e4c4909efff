// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/locate_step.h"

#include <gmock/gmock.h>

#include "support/datasets.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

LocateInput example() {
  return {read_detections(kExample + "detections.csv"), read_lamp_map(kExample + "lamps.yaml"),
          read_calibration(kExample + "calibration.yaml")};
}

TEST(LocateFrames, GivesAFixToEachOfTheExample) {
  const LocateResult found = locate_frames(example());
  EXPECT_TRUE(found.ok());
  EXPECT_EQ(found.summary.fixes, found.rows.size());
  EXPECT_THAT(found.warnings, IsEmpty());
  EXPECT_THAT(found.lamps_left_out, IsEmpty());
}

TEST(LocateFrames, CountsTheCapturesThatALampIsLeftOutOf) {
  LocateInput input = example();
  int moved = 0;
  for (Frame& frame : input.frames) {
    if (frame.detections.size() < 5 || moved == 3) continue;
    frame.detections.front().pixel.x() += 60;
    ++moved;
  }
  ASSERT_EQ(moved, 3);
  const LocateResult found = locate_frames(input);
  int captures = 0;
  for (const auto& [lamp, count] : found.lamps_left_out) captures += count;
  EXPECT_EQ(captures, 3);
  EXPECT_THAT(found.warnings,
              testing::Contains(HasSubstr("3 detections that contradict the others")));
}

TEST(LocateFrames, UsesInclinationsWhereThereAreSome) {
  LocateInput input = example();
  const double x_m = locate_frames(input).rows[0].fix->pose.position_m.x();
  Capture leaning;
  leaning.inclination = Inclination{0.01, 0};
  input.captures[input.frames[0].image] = leaning;
  const LocateResult found = locate_frames(input);
  EXPECT_GT(std::abs(found.rows[0].fix->pose.position_m.x() - x_m) +
                std::abs(found.rows[0].fix->pose.position_m.y()),
            0.001);
  EXPECT_THAT(found.warnings, testing::Contains(HasSubstr("images are not in captures.csv")));
}

TEST(LocateFrames, IsUndeterminedWithoutAFix) {
  LocateInput input = example();
  for (Frame& frame : input.frames) frame.detections.resize(1);
  const LocateResult found = locate_frames(input);
  EXPECT_EQ(found.failure, StepFailure::undetermined);
  EXPECT_THAT(found.why, HasSubstr("no frame has a fix; the first: "));
}

}  // namespace
}  // namespace vlp
