// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/outlier_rejection.h"

#include <gtest/gtest.h>

#include <array>

#include "support/matchers.h"

namespace vlp {
namespace {

const Pose kTruth{{0.1, -0.05, 0}, 0.4};

/// Observations of lamps at two heights by a level camera at the true pose.
std::array<Sighting, 5> sightings() {
  const std::array<Eigen::Vector3d, 5> lamps_m{Eigen::Vector3d{-0.6, -0.4, 1.6},
                                               {0.6, -0.4, 1.6},
                                               {0.6, 0.4, 1.8},
                                               {-0.6, 0.4, 1.6},
                                               {0, 0.5, 1.8}};
  std::array<Sighting, 5> seen;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    seen[i] = {lamps_m[i], predict_z(LevelPose(kTruth), lamps_m[i]), Matrix2::Identity(), 0.05};
  }
  return seen;
}

TEST(FindConsensus, ReturnsPoseWithSmallestResidualsAmongEqualCounts) {
  auto seen = sightings();
  seen[0].z.x() += 0.004;  // the first pairs propose wrong poses
  const auto consensus = find_consensus(seen, 0.1);
  ASSERT_TRUE(consensus);
  EXPECT_EQ(consensus->count, 5u);
  EXPECT_THAT(consensus->pose.position_m, IsNear(kTruth.position_m, 1e-12));
}

TEST(FindConsensus, ReturnsNulloptWithoutMajorityOfThree) {
  auto seen = sightings();
  seen[0].z.x() += 0.1, seen[1].z.y() -= 0.15;
  const auto consensus = find_consensus(seen, 0.01);
  ASSERT_TRUE(consensus);
  EXPECT_EQ(consensus->agreeing.to_ulong(), 0b11100u);
  EXPECT_FALSE(find_consensus(std::span(seen).first(4), 0.01)) << "two of four";
}

}  // namespace
}  // namespace vlp
