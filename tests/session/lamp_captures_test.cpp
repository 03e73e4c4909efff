// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lamp_captures.h"

#include <gtest/gtest.h>

namespace vlp {
namespace {

TEST(FindCaptureMotion, ReplacesDefaultByVelocityAndYawRateOfTable) {
  const KnownMotion limits = KnownMotion::make_motion_prior_from_limits(3, 2);
  Capture capture;
  EXPECT_FALSE(find_capture_motion(capture, std::nullopt, 0.1));
  auto motion = find_capture_motion(capture, limits, 0.1);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->velocity_sd_m_per_s, limits.velocity_sd_m_per_s);

  capture.velocity_m_per_s = Eigen::Vector2d(0.5, -0.2);
  motion = find_capture_motion(capture, limits, 0.1);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->velocity_m_per_s, Eigen::Vector2d(0.5, -0.2));
  EXPECT_EQ(motion->velocity_sd_m_per_s, 0);
  EXPECT_EQ(motion->yaw_rate_rad_per_s, limits.yaw_rate_rad_per_s);
  EXPECT_EQ(motion->yaw_rate_sd_rad_per_s, limits.yaw_rate_sd_rad_per_s);

  capture.velocity_sd_m_per_s = 0.05;
  capture.yaw_rate_rad_per_s = 0.7;
  motion = find_capture_motion(capture, limits, 0.1);
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->velocity_sd_m_per_s, 0.05);
  EXPECT_EQ(motion->yaw_rate_rad_per_s, 0.7);
  EXPECT_EQ(motion->yaw_rate_sd_rad_per_s, 0.1);
}

}  // namespace
}  // namespace vlp
