// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/fixes_table.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(FixesTable, HasTheColumnsOfTheContract) {
  const TemporaryFolder folder;
  const Pose pose{{1.5, -0.25, 0.1234567891}, 3};
  write_fixes(folder / "fixes.csv",
              {{"a.png", "ok", FixRow::Fix{pose, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4), 0.05}, 4},
               {"b.png", "ok", FixRow::Fix{pose, {}, 0}, 2},
               {"c,d.png", "too_few_lamps", {}, 0}});
  EXPECT_EQ(TemporaryFolder::content_of(folder / "fixes.csv"),
            "image,status,x_m,y_m,z_m,yaw_rad,sd_x_m,sd_y_m,sd_z_m,sd_yaw_rad,lamps,residual_px\n"
            "a.png,ok,1.500000000,-0.250000000,0.123456789,3.000000000,0.1,0.2,0.3,0.4,4,0.05\n"
            "b.png,ok,1.500000000,-0.250000000,0.123456789,3.000000000,,,,,2,0\n"
            "\"c,d.png\",too_few_lamps,,,,,,,,,0,\n");
}

}  // namespace
}  // namespace vlp
