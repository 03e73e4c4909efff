// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/outlier_rejection.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

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
    seen[i] = {lamps_m[i], project_lamp_to_normalized_point(LevelPose(kTruth), lamps_m[i]),
               Matrix2::Identity(), 0.05};
  }
  return seen;
}

TEST(FindLargestConsistentLampSet, ReturnsPoseWithSmallestResidualsAmongEqualCounts) {
  auto seen = sightings();
  seen[0].z.x() += 0.004;  // the first pairs propose wrong poses
  const auto consensus = find_largest_consistent_lamp_set(seen, 0.1);
  ASSERT_TRUE(consensus);
  EXPECT_EQ(consensus->count, 5u);
  EXPECT_THAT(consensus->pose.position_m, IsNear(kTruth.position_m, 1e-12));
}

TEST(FindLargestConsistentLampSet, ReturnsNulloptWhenFewerThanThreeLampsAgree) {
  auto seen = sightings();
  seen[0].z.x() += 0.1, seen[1].z.y() -= 0.15;
  const auto consensus = find_largest_consistent_lamp_set(seen, 0.01);
  ASSERT_TRUE(consensus);
  EXPECT_EQ(consensus->inliers.to_ulong(), 0b11100u);
  EXPECT_FALSE(find_largest_consistent_lamp_set(std::span(seen).first(4), 0.01)) << "two of four";
}

/// A frame under a map whose lamps have this distance to their nearest neighbors.
FrameObservations make_frame(std::span<const Sighting> seen, double nearest_m) {
  FrameObservations frame;
  for (const Sighting& sighting : seen) {
    frame.ids[frame.size] = static_cast<int>(frame.size);
    frame.nearest_m[frame.size] = nearest_m;
    frame.sightings[frame.size++] = sighting;
  }
  return frame;
}

double compute_rms_distance_from_mean(std::span<const Eigen::Vector2d> points) {
  const Eigen::Vector2d mean =
      std::accumulate(points.begin(), points.end(), Eigen::Vector2d(0, 0)) /
      static_cast<double>(points.size());
  double sum = 0;
  for (const Eigen::Vector2d& point : points) sum += (point - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// One of three lamps is displaced, so that the largest residual is 0.9 or 1.1 times the limit.
TEST(EstimatePoseRobust, ReturnsInconsistentBeyondEitherResidualLimit) {
  const auto five = sightings();
  const auto exact = std::span(five).first<3>();
  std::vector<Eigen::Vector2d> points, positions_m;
  for (const Sighting& sighting : exact) {
    points.push_back(sighting.z);
    positions_m.push_back(sighting.lamp_m.head<2>());
  }
  const double spread = compute_rms_distance_from_mean(points);
  const double scale = spread / compute_rms_distance_from_mean(positions_m);
  const auto displace = [&](double by) {
    std::vector<Sighting> displaced(exact.begin(), exact.end());
    displaced[0].z.x() += by;
    return displaced;
  };
  constexpr double small = 1e-4;
  const auto slightly = displace(small);
  const ConsistentFix fix = estimate_and_check_pose(slightly, 1);
  ASSERT_EQ(fix.status, FixStatus::ok);
  double residual = 0;
  for (const Sighting& sighting : slightly) {
    const LevelPose pose(fix.fix.pose);
    residual = std::max(
        residual, (sighting.z - project_lamp_to_normalized_point(pose, sighting.lamp_m)).norm());
  }
  ASSERT_GT(residual, 0.1 * small);
  constexpr double fraction = 0.02, neighbor_fraction = 0.15;
  for (const double nearest_m : {100.0, 0.05}) {
    const double limit = std::min(fraction * spread, neighbor_fraction * nearest_m * scale);
    for (const auto& [factor, status] :
         {std::pair(0.9, FixStatus::ok), {1.1, FixStatus::inconsistent}}) {
      FrameObservations frame = make_frame(displace(factor * limit * small / residual), nearest_m);
      EXPECT_EQ(estimate_pose_robust(frame, fraction).status, status)
          << nearest_m << " m, " << factor;
    }
  }
}

/// Lamps of a mirrored map with large errors in the direction that has almost no weight.
TEST(EstimatePoseRobust, WeighsMirroredObservationsByTheirCovariance) {
  std::vector<Sighting> seen;
  double angle_rad = 0.6, error = 0.1;
  for (const double x_m : {-0.6, -0.2, 0.3, 0.6}) {
    for (const double y_m : {-0.4, 0.1, 0.5}) {
      const Eigen::Matrix2d axes = Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
      const Eigen::Vector3d lamp_m(x_m, y_m, y_m > 0 ? 1.8 : 1.6);
      const Eigen::Vector2d z =
          project_lamp_to_normalized_point(LevelPose(kTruth), lamp_m) + error * axes.col(1);
      const Eigen::DiagonalMatrix<double, 2> weights(1000, 0.1), mirror(1, -1);
      seen.push_back({lamp_m, mirror * z, weights * axes.transpose() * mirror, 0.01});
      angle_rad += 0.7;
      error = -error;
    }
  }
  constexpr double any_residual = 10, far_m = 100;
  FrameObservations frame = make_frame(seen, far_m);
  ASSERT_EQ(estimate_and_check_pose(seen, any_residual).status, FixStatus::ok);
  EXPECT_EQ(estimate_pose_robust(frame, any_residual).status, FixStatus::mirrored_map);
}

TEST(EstimateAndCheckPose, ReturnsDegenerateWhenHeightSdExceedsHeight) {
  auto seen = sightings();
  for (Sighting& sighting : seen) sighting.lamp_m.z() += 2;  // all of it 2 m higher
  const ConsistentFix fix = estimate_and_check_pose(seen, 1);
  ASSERT_EQ(fix.status, FixStatus::ok);
  EXPECT_NEAR(fix.fix.pose.position_m.z(), 2, 1e-9);
  const double height_m = seen.front().lamp_m.z() - 2;
  const double height_sd_m = std::sqrt(fix.fix.covariance(2, 2));
  for (const auto& [factor, status] :
       {std::pair(0.98, FixStatus::ok), {1.02, FixStatus::degenerate}}) {
    auto noisy = seen;
    for (Sighting& sighting : noisy) sighting.sigma_px *= factor * height_m / height_sd_m;
    EXPECT_EQ(estimate_and_check_pose(noisy, 1).status, status) << factor;
  }
}

/// The first full step from far below leads above the lamps, and is halved.
TEST(EstimatePoseLeastSquares, ConvergesToTruthFromInitialPoseFarBelow) {
  const auto seen = sightings();
  const auto fix = estimate_pose_least_squares(seen, {{0, 0, -5}, 0.3});
  ASSERT_TRUE(fix);
  EXPECT_THAT(fix->pose.position_m, IsNear(kTruth.position_m, 1e-9));
  EXPECT_NEAR(fix->pose.yaw_rad, kTruth.yaw_rad, 1e-9);
}

}  // namespace
}  // namespace vlp
