// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "rig/samples.h"
#include "support/matchers.h"

// The formats are shared with the people who took the real captures.
namespace vlp {
namespace {

class RealFiles : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(VLP_REAL_DATA_DIR)) {
      GTEST_SKIP() << "there are no real captures: set VLP_REAL_DATA_DIR";
    }
  }
  const std::filesystem::path data = VLP_REAL_DATA_DIR;
};

TEST_F(RealFiles, ReadLampMapReturnsLampsOfRealMaps) {
  const LampMap log = read_lamp_map(data / "ceiling-lamps-log" / "lamps.yaml");
  ASSERT_EQ(log.lamps.size(), 8U);
  EXPECT_EQ(log.lamps[7].id, 8);
  EXPECT_THAT(log.lamps[7].position_m, IsNear(Eigen::Vector3d(1.24, 0.052, 2.1), 0));
  EXPECT_FALSE(log.lamps[7].frequency_hz);

  const LampMap luxapose = read_lamp_map(data / "luxapose" / "lamps.yaml");
  ASSERT_EQ(luxapose.lamps.size(), 5U);
  EXPECT_EQ(luxapose.lamps[3].id, 3500);
  EXPECT_THAT(luxapose.lamps[3].position_m, IsNear(Eigen::Vector3d(0.3556, -0.3683, 2.46), 0));
  EXPECT_EQ(luxapose.lamps[3].frequency_hz, 3500);
  EXPECT_EQ(luxapose.lamps[3].duty, 0.5);
}

TEST_F(RealFiles, ReadBoardReturnsRealBoards) {
  expect_same(read_board(data / "apriltag-lattice-phone" / "board.yaml"),
              {"tag36h11", 8, 5, 0.016, 1.0, 1, false, 1, {true, BoardCorner::top_left}});
  expect_same(read_board(data / "kalibr-aprilgrid-stereo" / "board.yaml"),
              {"tag36h11", 5, 4, 0.02, 0.2, 2, true, 0, {false, BoardCorner::bottom_left}});
}

}  // namespace
}  // namespace vlp
