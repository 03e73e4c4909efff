// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/fixes_table.h"

#include <gmock/gmock.h>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

TEST(WriteFixes, WritesExpectedHeaderAndRowOfEachFix) {
  const TemporaryFolder folder;
  const Pose pose{{1.5, -0.25, 0.1234567891}, 3};
  write_fixes(folder / "fixes.csv",
              {{"a.png", "ok", FixRow::Fix{pose, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4), 0.05}, 4},
               {"b.png", "ok", FixRow::Fix{pose, {}, 0}, 2},
               {"c,d.png", "too_few_lamps", {}, 0}});
  EXPECT_EQ(TemporaryFolder::read_content(folder / "fixes.csv"),
            "image,status,x_m,y_m,z_m,yaw_rad,x_sd_m,y_sd_m,z_sd_m,yaw_sd_rad,lamps,residual_px\n"
            "a.png,ok,1.500000000,-0.250000000,0.123456789,3.000000000,0.1,0.2,0.3,0.4,4,0.05\n"
            "b.png,ok,1.500000000,-0.250000000,0.123456789,3.000000000,,,,,2,0\n"
            "\"c,d.png\",too_few_lamps,,,,,,,,,0,\n");
}

TEST(ReadFixes, ReturnsRowsWrittenByWriteFixes) {
  const TemporaryFolder folder;
  const Pose pose{{1.5, -0.25, 0.125}, 3};
  write_fixes(folder / "fixes.csv",
              {{"a.png", "ok", FixRow::Fix{pose, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4), 0.05}, 4},
               {"b.png", "ok", FixRow::Fix{pose, {}, 0}, 2},
               {"c,d.png", "too_few_lamps", {}, 1}});
  const auto rows = read_fixes(folder / "fixes.csv");
  ASSERT_EQ(rows.size(), 3);
  ASSERT_TRUE(rows[0].fix && rows[0].fix->sd && rows[1].fix);
  EXPECT_EQ(rows[0].fix->pose.position_m, pose.position_m);
  EXPECT_EQ(rows[0].fix->pose.yaw_rad, 3);
  EXPECT_EQ(*rows[0].fix->sd, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4));
  EXPECT_EQ(rows[0].fix->residual_px, 0.05);
  EXPECT_EQ(rows[0].lamps, 4);
  EXPECT_FALSE(rows[1].fix->sd);
  EXPECT_EQ(rows[2].image, "c,d.png");
  EXPECT_EQ(rows[2].status, "too_few_lamps");
  EXPECT_FALSE(rows[2].fix);
  EXPECT_EQ(rows[2].line, 4);
}

TEST(WriteFixes, WritesTimeVelocityAndInclinationColumnsOnlyWhenGiven) {
  const TemporaryFolder folder;
  const Pose pose{{1.5, -0.25, 0.125}, 3};
  FixRow moving{"a.png", "ok", FixRow::Fix{pose, {}, 0.05}, 4};
  moving.time_s = 0.5;
  moving.fix->velocity_m_per_s = Eigen::Vector2d(1, -0.5);
  moving.fix->inclination = Inclination{0.25, -0.125};
  FixRow lost{"b.png", "too_few_lamps", {}, 1};
  lost.time_s = 0.75;
  write_fixes(folder / "fixes.csv", {moving, lost});
  EXPECT_EQ(TemporaryFolder::read_content(folder / "fixes.csv"),
            "image,status,x_m,y_m,z_m,yaw_rad,x_sd_m,y_sd_m,z_sd_m,yaw_sd_rad,lamps,residual_px,"
            "time_s,vx_m_per_s,vy_m_per_s,roll_rad,pitch_rad\n"
            "a.png,ok,1.500000000,-0.250000000,0.125000000,3.000000000,,,,,4,0.05,0.500000000,"
            "1.000000000,-0.500000000,0.250000000,-0.125000000\n"
            "b.png,too_few_lamps,,,,,,,,,1,,0.750000000,,,,\n");
  const auto rows = read_fixes(folder / "fixes.csv");
  ASSERT_EQ(rows.size(), 2);
  ASSERT_TRUE(rows[0].fix && rows[0].fix->inclination);
  EXPECT_EQ(rows[0].time_s, 0.5);
  EXPECT_EQ(rows[0].fix->velocity_m_per_s, Eigen::Vector2d(1, -0.5));
  EXPECT_EQ(rows[0].fix->inclination->roll_rad, 0.25);
  EXPECT_EQ(rows[0].fix->inclination->pitch_rad, -0.125);
  EXPECT_EQ(rows[1].time_s, 0.75);
  moving.time_s.reset();
  moving.fix->inclination.reset();
  write_fixes(folder / "fixes.csv", {moving});
  EXPECT_THAT(TemporaryFolder::read_content(folder / "fixes.csv"),
              testing::HasSubstr("residual_px,vx_m_per_s,vy_m_per_s\n"));
}

TEST(ReadFixes, ReportsFileLineAndColumnOfInvalidRow) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& rows) {
    const std::string header = "image,status,x_m,y_m,z_m,yaw_rad,x_sd_m,y_sd_m,z_sd_m,yaw_sd_rad\n";
    return rejection_message([&] { read_fixes(folder.file("fixes.csv", header + rows)); });
  };
  using testing::HasSubstr;
  EXPECT_EQ(refusal("a,ok,0,0,0,0,,,,\nb,bad,x,,,,,,,\n"), "");
  EXPECT_THAT(refusal("a,ok,0,0,0,0,,,,\na,bad,,,,,,,,\n"),
              HasSubstr("fixes.csv:3: image: 'a' occurs twice"));
  EXPECT_THAT(refusal("a,ok,0,NaN,0,0,,,,\n"), HasSubstr("fixes.csv:2: y_m"));
  EXPECT_EQ(refusal("a,ok,-1e6,1e6,0,0,,,,\n"), "");
  EXPECT_THAT(refusal("a,ok,0,0,0,0,,,,\nb,ok,0,-1e308,0,0,,,,\n"),
              HasSubstr("fixes.csv:3: y_m: should be within 1,000 km, in meters, not '-1e308'"));
  EXPECT_THAT(refusal("a,ok,1000001,0,0,0,,,,\n"), HasSubstr("fixes.csv:2: x_m"));
  EXPECT_THAT(refusal("a,ok,0,0,1e7,0,,,,\n"), HasSubstr("fixes.csv:2: z_m"));
  EXPECT_THAT(refusal("a,ok,0,0,0,0,1,1,1,-1\n"), HasSubstr("fixes.csv:2: yaw_sd_rad"));
  EXPECT_THAT(refusal("a,,0,0,0,0,,,,\n"), HasSubstr("fixes.csv:2: status: is empty"));
  EXPECT_THAT(refusal("a,ok,0,0\n"), HasSubstr("fixes.csv:2: has 4 fields"));
  EXPECT_THAT(refusal(""), HasSubstr("fixes.csv: contains no fix"));
}

TEST(WriteFixes, WritesNoiseSdsAndRejectedLampsOnlyWhenGiven) {
  const TemporaryFolder folder;
  FixRow plain{"a", "ok", FixRow::Fix{{{1, 2, 3}, 0.5}, Eigen::Vector4d(1, 1, 1, 1), 0.1}, 4};
  FixRow whole = plain;
  whole.image = "b";
  whole.fix->noise_sd = Eigen::Vector4d(0.25, 0.25, 0.5, 0.125);
  whole.rejected_lamps = {7, 12};
  whole.lamps_outside_region = {3, 5};
  write_fixes(folder / "plain.csv", {plain});
  EXPECT_THAT(folder.read_content(folder / "plain.csv"),
              testing::Not(testing::HasSubstr("x_noise_sd_m")));
  write_fixes(folder / "whole.csv", {plain, whole});
  EXPECT_THAT(folder.read_content(folder / "whole.csv"),
              HasSubstr("residual_px,x_noise_sd_m,y_noise_sd_m,z_noise_sd_m,yaw_noise_sd_rad,"
                        "rejected,outside_region\n"));
  EXPECT_THAT(folder.read_content(folder / "whole.csv"), HasSubstr("7 12"));
  const auto read = read_fixes(folder / "whole.csv");
  ASSERT_EQ(read.size(), 2);
  ASSERT_TRUE(read[0].fix && read[1].fix);
  EXPECT_FALSE(read[0].fix->noise_sd);
  EXPECT_EQ(read[1].fix->noise_sd, whole.fix->noise_sd);
  EXPECT_TRUE(read[0].rejected_lamps.empty());
  EXPECT_EQ(read[1].rejected_lamps, whole.rejected_lamps);
  EXPECT_TRUE(read[0].lamps_outside_region.empty());
  EXPECT_EQ(read[1].lamps_outside_region, whole.lamps_outside_region);
}

TEST(ReadFixes, RejectsInvalidIdsOfRejectedLamps) {
  const TemporaryFolder folder;
  for (const char* ids : {"7;12", "lamp", "7 x", "7  12", "99999999999"}) {
    const auto file =
        folder.file("fixes.csv", std::string("image,status,x_m,y_m,z_m,yaw_rad,rejected\n"
                                             "a,ok,0,0,0,0,") +
                                     ids + "\n");
    EXPECT_THAT(rejection_message([&] { read_fixes(file); }),
                HasSubstr("fixes.csv:2: rejected: should be ids of lamps, separated by blanks"))
        << ids;
  }
}

}  // namespace
}  // namespace vlp
