// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/run_record.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::SizeIs;

TEST(LibraryVersions, NamesThoseThatTheResultRestsOn) {
  for (const char* library : {"OpenCV ", "AprilTag ", "mrcal ", "Ceres ", "Eigen "}) {
    EXPECT_THAT(library_versions(),
                testing::ContainsRegex(std::string(library) + "[0-9]+\\.[0-9]"));
  }
}

/// Where a second begins two clocks may differ by a tick.
TEST(SecondsSince, IsNeverBelow0ForNow) {
  const std::string begin = now_utc();
  while (seconds_since(begin) < 1) {
    const std::string now = now_utc();
    ASSERT_GE(seconds_since(now), 0) << now;
  }
}

TEST(RunName, TellsWhenTheRunBegan) {
  EXPECT_EQ(begun_utc("20261121T134501Z-0123456789abcdef"), "2026-11-21T13:45:01Z");
  EXPECT_EQ(begun_utc("run"), "");
  const std::string run = new_run();
  EXPECT_THAT(run, SizeIs(33));
  EXPECT_LE(begun_utc(run), now_utc());
  EXPECT_NE(run, new_run());
}

}  // namespace
}  // namespace vlp
