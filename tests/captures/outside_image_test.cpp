// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/outside_image.h"

#include <gtest/gtest.h>

namespace vlp {
namespace {

std::size_t far_outside(double u_px, double v_px) {
  const Detection detection{1, {u_px, v_px}, {}};
  return count_far_outside(std::array{Frame{"a", {detection, detection}}, Frame{"b", {}}},
                           {800, 600});
}

TEST(CountFarOutside, CountsDetectionsBeyondTenPercent) {
  for (const auto& [u_px, v_px] : {std::pair(400, 300), {-79, 300}, {879, 300}, {400, -59}}) {
    EXPECT_EQ(far_outside(u_px, v_px), 0) << u_px << " " << v_px;
  }
  for (const auto& [u_px, v_px] : {std::pair(-81, 300), {881, 300}, {400, -61}, {400, 661}}) {
    EXPECT_EQ(far_outside(u_px, v_px), 2) << u_px << " " << v_px;
  }
}

}  // namespace
}  // namespace vlp
