// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_step.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <numbers>

#include "support/datasets.h"

namespace vlp {
namespace {

using testing::Each;
using testing::SizeIs;

/// The example's rotation: 12 captures at each of two heights, 30 degrees apart.
struct YawCoverageTest : testing::Test {
  YawCoverageTest() {
    config.lamps = read_lamp_map(kExample + "lamps.yaml");
    config.completion.rotation_captures = 12;
    config.completion.rotation_heights = 2;
  }
  StationConfig config{};
  Calibration calibration = read_calibration(kExample + "calibration.yaml");
  std::vector<Frame> frames = read_detections(kExample + "turning.csv");
};

TEST_F(YawCoverageTest, IsSufficientForCapturesAroundFullTurn) {
  const YawCoverage map = compute_yaw_coverage(frames, config, calibration);
  ASSERT_THAT(map.heights, SizeIs(2));
  for (const auto& height : map.heights) {
    EXPECT_EQ(height.captures, 12);
    EXPECT_THAT(height.covered_sectors, Each(true));
    EXPECT_GT(height.arc_rad, 1.6 * std::numbers::pi);
  }
  EXPECT_TRUE(map.sufficient);
}

TEST_F(YawCoverageTest, MarksMissingYawsAndIsInsufficient) {
  frames.erase(frames.begin() + 4, frames.begin() + 7);
  const YawCoverage map = compute_yaw_coverage(frames, config, calibration);
  ASSERT_THAT(map.heights, SizeIs(2));
  const auto& parts = map.heights[0].captures == 9 ? map.heights[0].covered_sectors
                                                   : map.heights[1].covered_sectors;
  EXPECT_EQ(std::count(parts.begin(), parts.end(), false), 3);
  EXPECT_FALSE(map.sufficient);
}

// Not from the lowest capture, which depends on the last micrometers of the fixes.
TEST_F(YawCoverageTest, FirstSectorIsAtYawOfFirstCapture) {
  frames.resize(3);
  const auto forwards =
      compute_yaw_coverage(frames, config, calibration).heights.at(0).covered_sectors;
  std::reverse(frames.begin(), frames.end());
  const auto backwards =
      compute_yaw_coverage(frames, config, calibration).heights.at(0).covered_sectors;
  EXPECT_EQ(std::count(forwards.begin(), forwards.end(), true), 3);
  EXPECT_TRUE(forwards[0] && backwards[0]);
  EXPECT_NE(forwards[1], backwards[1]);
  EXPECT_NE(forwards[11], backwards[11]);
}

TEST_F(YawCoverageTest, ReturnsEachHeightAndRequiresConfiguredNumberOfHeights) {
  frames.erase(frames.begin() + 12, frames.end());
  EXPECT_THAT(compute_yaw_coverage(frames, config, calibration).heights, SizeIs(1));
  EXPECT_FALSE(compute_yaw_coverage(frames, config, calibration).sufficient);
  config.completion.rotation_heights = 1;
  EXPECT_TRUE(compute_yaw_coverage(frames, config, calibration).sufficient);
  EXPECT_THAT(compute_yaw_coverage({}, config, calibration).heights, SizeIs(0));
}

}  // namespace
}  // namespace vlp
