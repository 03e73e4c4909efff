// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/map/row_time_error.h"

#include <gtest/gtest.h>

#include <vector>

namespace vlp {
namespace {

TEST(FindTrueRowTime, MatchesLightsWithLamps) {
  LampMap map;
  for (const double frequency_hz : {500., 640., 800., 1000., 1280., 1600.}) {
    Lamp lamp{};
    lamp.position_m.setZero();
    lamp.frequency_hz = frequency_hz;
    map.lamps.push_back(lamp);
  }
  constexpr double row_time_s = 3e-5;
  for (const double ratio : {0.9, 1.1, 1.05}) {
    std::vector<double> seen_hz;
    for (int i = 0; i < 24; ++i) {
      const double noise = 1 + 0.002 * (i % 3 - 1);
      const Lamp& lamp = map.lamps[static_cast<std::size_t>(i) % 4];
      seen_hz.push_back(*lamp.frequency_hz * ratio * noise);
    }
    seen_hz.push_back(3210);  // something else
    const auto found_s = find_true_row_time(seen_hz, map, row_time_s);
    ASSERT_TRUE(found_s) << ratio;
    EXPECT_NEAR(*found_s / (row_time_s * ratio), 1, 0.003);
  }
  // The lights are lamps with the stated row time, too.
  for (const double ratio : {1., 0.99, 1.02}) {
    std::vector<double> seen_hz;
    for (const Lamp& lamp : map.lamps) seen_hz.push_back(*lamp.frequency_hz * ratio);
    EXPECT_FALSE(find_true_row_time(seen_hz, map, row_time_s)) << ratio;
  }
  // The lights match no lamps.
  EXPECT_FALSE(find_true_row_time(std::vector<double>{510, 700, 905, 1033, 1111, 1401, 1777}, map,
                                  row_time_s));
  EXPECT_FALSE(find_true_row_time(std::vector<double>{}, map, row_time_s));
}

}  // namespace
}  // namespace vlp
