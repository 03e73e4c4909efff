// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/capture_options.h"

#include <gmock/gmock.h>

#include "geometry/angles.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

TEST(MotionOptions, MakeMotionPriorIsNulloptWithoutSpeed) {
  EXPECT_FALSE(MotionOptions{}.make_motion_prior());
  const MotionOptions drives{2.0, {}}, straight{2.0, 0.0};
  ASSERT_TRUE(drives.make_motion_prior());
  EXPECT_GT(drives.make_motion_prior()->yaw_rate_sd_rad_per_s, rad_from_deg(45));
  EXPECT_EQ(straight.make_motion_prior()->yaw_rate_sd_rad_per_s, 0);
  EXPECT_EQ(straight.make_motion_prior()->velocity_sd_m_per_s,
            drives.make_motion_prior()->velocity_sd_m_per_s);
}

TEST(CheckEveryOption, ThrowsForStepAboveOneWithoutVideo) {
  check_every_option(1, {"boards"});
  check_every_option(5, {"boards", "boards.mp4"});
  EXPECT_EQ(rejection_message<std::invalid_argument>([] { check_every_option(5, {"boards"}); }),
            "--every: there is no video; leave it out");
}

}  // namespace
}  // namespace vlp
