// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/limits_table.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(WriteFloorLimits, WritesColumnPerErrorSourceAndEmptyCellsWithoutFix) {
  Matrix4 noise = Matrix4::Zero(), tilt = Matrix4::Zero();
  noise.diagonal() << 9e-6, 0, 4e-6, 1e-6;
  tilt(1, 1) = 16e-6;
  const FloorLimits limits{{{"noise", "noise"}, {"tilt", "tilt"}},
                           {{{{0.5, 1, 0}, 0.25}, 3, {noise, tilt}}, {{{1, 1, 0}, 0.25}, 1, {}}}};
  const TemporaryFolder folder;
  write_floor_limits(folder / "limits.csv", limits);
  EXPECT_EQ(
      TemporaryFolder::read_content(folder / "limits.csv"),
      "x_m,y_m,z_m,yaw_rad,lamps,x_sd_m,y_sd_m,z_sd_m,yaw_sd_rad,noise_m,tilt_m,horizontal_m\n"
      "0.5,1,0,0.25,3,0.003,0.004,0.002,0.001,0.003,0.004,0.005\n"
      "1,1,0,0.25,1,,,,,,,\n");
}

}  // namespace
}  // namespace vlp
