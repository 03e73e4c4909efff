// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/captures_table.h"

#include <gmock/gmock.h>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

TEST(ReadCapturesCsv, ReadsColumnsInAnyOrderAndLeavesMissingOnesEmpty) {
  const TemporaryFolder folder;
  const auto captures = read_captures_csv(
      folder.file("captures.csv",
                  "image,z_m,roll_rad,yaw_rad,pitch_rad,time_s\na,0.1,0.01,3,0.02,5\nb,,,,,\n"));
  ASSERT_EQ(captures.size(), 2);
  const Capture& a = captures.at("a");
  EXPECT_EQ(a.z_m, 0.1);
  EXPECT_EQ(a.yaw_rad, 3);
  EXPECT_EQ(a.time_s, 5);
  EXPECT_FALSE(a.x_m);
  ASSERT_TRUE(a.inclination);
  EXPECT_EQ(a.inclination->roll_rad, 0.01);
  EXPECT_EQ(a.inclination->pitch_rad, 0.02);
  EXPECT_FALSE(captures.at("b").inclination);
  EXPECT_FALSE(captures.at("b").z_m);
}

TEST(ReadCapturesCsv, ReadsReferencePointPositionSdAndPivotColumns) {
  const TemporaryFolder folder;
  const auto captures = read_captures_csv(folder.file(
      "captures.csv",
      "image,x_m,y_m,reference_point,position_sd_m,pivot\na,1,2,axis,0.001,s1\nb,1,2,,,\n"));
  EXPECT_EQ(captures.at("a").measured_point, MeasuredPoint::axis);
  EXPECT_EQ(captures.at("a").position_sd_m, 0.001);
  EXPECT_EQ(captures.at("a").pivot, "s1");
  EXPECT_EQ(captures.at("b").measured_point, MeasuredPoint::camera);
  EXPECT_FALSE(captures.at("b").position_sd_m);
  EXPECT_TRUE(captures.at("b").pivot.empty());
}

TEST(ReadCapturesCsv, ReadsVelocityYawRateAndVelocitySdColumns) {
  const TemporaryFolder folder;
  const auto captures = read_captures_csv(folder.file(
      "captures.csv",
      "image,vx_m_per_s,vy_m_per_s,yaw_rate_rad_per_s,velocity_sd_m_per_s\na,1,-2,0.5,0.01\n"
      "b,3,4,,\nc,,,,\n"));
  const Capture& a = captures.at("a");
  EXPECT_EQ(a.velocity_m_per_s, Eigen::Vector2d(1, -2));
  EXPECT_EQ(a.yaw_rate_rad_per_s, 0.5);
  EXPECT_EQ(a.velocity_sd_m_per_s, 0.01);
  EXPECT_EQ(captures.at("b").velocity_m_per_s, Eigen::Vector2d(3, 4));
  EXPECT_FALSE(captures.at("b").yaw_rate_rad_per_s);
  EXPECT_FALSE(captures.at("c").velocity_m_per_s);
}

TEST(ReadCapturesCsv, RejectsInvalidOrContradictoryRows) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& content) {
    return rejection_message([&] { read_captures_csv(folder.file("c.csv", content)); });
  };
  EXPECT_THAT(refusal("z_m\n1\n"), HasSubstr("c.csv:1: image: this column is missing"));
  EXPECT_THAT(refusal("image\na\na\n"), HasSubstr("c.csv:3: image: 'a' occurs twice"));
  EXPECT_THAT(refusal("image,roll_rad\na,0.1\n"), HasSubstr("without the other"));
  EXPECT_THAT(refusal("image,vx_m_per_s\na,0.1\n"),
              HasSubstr("c.csv:2: image: has one of vx_m_per_s and vy_m_per_s without the other"));
  EXPECT_THAT(refusal("image,vx_m_per_s,vy_m_per_s,velocity_sd_m_per_s\na,1,1,-1\n"),
              HasSubstr("c.csv:2: velocity_sd_m_per_s: should not be negative"));
  EXPECT_THAT(refusal("image,velocity_sd_m_per_s\na,1\n"), HasSubstr("has no velocity"));
  EXPECT_THAT(refusal("image,z_m\na,high\n"), HasSubstr("c.csv:2: z_m: should be a finite number"));
  EXPECT_THAT(refusal("image,z_m\n,1\n"), HasSubstr("c.csv:2: image: is empty"));
  EXPECT_THAT(refusal("image,reference_point\na,robot\n"), HasSubstr("should be camera or axis"));
  EXPECT_THAT(refusal("image,position_sd_m\na,-1\n"), HasSubstr("should not be negative"));
}

}  // namespace
}  // namespace vlp
