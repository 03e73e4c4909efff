// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/reference_points.h"

#include <gtest/gtest.h>

#include "support/random.h"

namespace vlp {
namespace {

TEST(GroupPositions, GroupsPositionsWithinRadiusOfFirst) {
  const std::vector<Eigen::Vector3d> places_m{
      {0, 0, 0},         {0.0009, 0, 0}, {0.0018, 0, 0},  // 0.9 mm from the second, not the first
      {0, 0, 0.0015},    {0, 0, 0.0006}, {-0.0005, -0.0005, -0.0005},
      {0.0018, 0.001, 0}};
  EXPECT_EQ(group_positions(places_m, 1e-3), (std::vector<std::size_t>{0, 0, 1, 2, 0, 0, 1}));
}

/// Compares with the definition, for cells on all sides of the origin.
TEST(GroupPositions, MatchesLinearSearchOverFirstPositions) {
  Random random(1);
  std::vector<Eigen::Vector3d> places_m;
  for (int i = 0; i < 2000; ++i) {
    places_m.emplace_back(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-1, 1));
  }
  std::vector<Eigen::Vector3d> firsts_m;
  std::vector<std::size_t> expected;
  for (const auto& place_m : places_m) {
    std::size_t station = 0;
    while (station < firsts_m.size() && (firsts_m[station] - place_m).norm() > 0.5) ++station;
    if (station == firsts_m.size()) firsts_m.push_back(place_m);
    expected.push_back(station);
  }
  EXPECT_EQ(group_positions(places_m, 0.5), expected);
}

}  // namespace
}  // namespace vlp
