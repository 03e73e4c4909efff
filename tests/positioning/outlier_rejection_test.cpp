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

/// Tests of find_outlier_lamps(): seven lamps, seen exactly from the true pose.
class FindOutlierLamps : public testing::Test {
 protected:
  static constexpr double kSigma_px = 0.05;
  std::vector<Sighting> seen = make_sightings();
  std::vector<Matrix2> common = std::vector<Matrix2>(seen.size(), Matrix2::Zero());

  static std::vector<Sighting> make_sightings() {
    std::vector<Sighting> exact;
    for (const Eigen::Vector3d& lamp_m : {Eigen::Vector3d{-0.6, -0.4, 1.6},
                                          {0.6, -0.4, 1.6},
                                          {0.6, 0.4, 1.8},
                                          {-0.6, 0.4, 1.6},
                                          {0, 0.5, 1.8},
                                          {-0.2, -0.5, 1.7},
                                          {0.3, 0.1, 1.6}}) {
      exact.push_back({lamp_m, project_lamp_to_normalized_point(LevelPose(kTruth), lamp_m),
                       400 * Matrix2::Identity(), kSigma_px});
    }
    return exact;
  }
  /// Displaces a lamp in the image.
  void displace(std::size_t lamp, const Eigen::Vector2d& by_px) {
    seen[lamp].z += seen[lamp].d_pixel_d_z.inverse() * by_px;
  }
  /// Returns the indices of the outliers among the first `count` lamps, in the order of rejection.
  std::vector<std::size_t> find(std::size_t count) const {
    const OutlierLamps found =
        find_outlier_lamps(std::span(seen).first(count), std::span(common).first(count),
                           {kTruth, Matrix4::Zero(), 0, 0});
    return {found.lamps.begin(), found.lamps.begin() + static_cast<std::ptrdiff_t>(found.count)};
  }
  /// Returns the chi-squared of the least-squares fix of the first `count` lamps.
  double compute_chi_squared(std::size_t count) const {
    const auto fix = estimate_pose_least_squares(std::span(seen).first(count), kTruth);
    return fix ? fix->chi_squared : 0;
  }
};

TEST_F(FindOutlierLamps, RejectsLampBeyondQuantileOfChiSquared) {
  // Upper 1e-4 quantiles of chi-squared with 2 n - 4 degrees of freedom.
  for (const auto& [count, quantile] :
       {std::pair<std::size_t, double>(4, 23.51), {5, 27.86}, {6, 31.83}, {7, 35.56}}) {
    seen = make_sightings();
    displace(1, {0.01, 0.02});
    const double chi_squared = compute_chi_squared(count);
    ASSERT_GT(chi_squared, 0);
    for (const auto& [factor, is_rejected] : {std::pair(0.97, false), {1.03, true}}) {
      seen = make_sightings();
      displace(1, std::sqrt(factor * quantile / chi_squared) * Eigen::Vector2d(0.01, 0.02));
      EXPECT_EQ(find(count), is_rejected ? std::vector<std::size_t>{1} : std::vector<std::size_t>{})
          << count << " lamps, " << factor;
    }
  }
}

TEST_F(FindOutlierLamps, RejectsNoLampAmongThree) {
  displace(0, {5, 0});
  EXPECT_TRUE(find(3).empty());
}

/// The accurate lamp determines the fix, so that its residual is smaller than those of the others.
TEST_F(FindOutlierLamps, RejectsAccurateLampWithSmallResidual) {
  for (const std::size_t accurate : {0U, 2U, 4U}) {
    seen = make_sightings();
    seen[accurate].sigma_px /= 10;
    displace(accurate, {0.8, -0.6});
    EXPECT_EQ(find(5), std::vector<std::size_t>{accurate});
  }
}

TEST_F(FindOutlierLamps, RejectsLampsInOrderOfTheirErrors) {
  displace(4, {1, 0.3});
  displace(2, {-3, 2});
  displace(5, {0.2, -0.4});
  EXPECT_EQ(find(7), (std::vector<std::size_t>{2, 4, 5}));
}

TEST_F(FindOutlierLamps, RejectsNoneWithoutMajority) {
  displace(2, {-3, 2});
  displace(4, {1, 0.5});
  EXPECT_EQ(find(5), (std::vector<std::size_t>{2, 4})) << "three of five remain";
  EXPECT_EQ(find(6), (std::vector<std::size_t>{2, 4}));
  displace(0, {20, 30});
  EXPECT_EQ(find(7), (std::vector<std::size_t>{0, 2, 4})) << "four of seven remain";
  EXPECT_TRUE(find(6).empty()) << "three of six";
  EXPECT_TRUE(find(5).empty()) << "two of five";
}

TEST_F(FindOutlierLamps, RejectsNoneWhenTwoOfFourLampsAreDisplaced) {
  displace(2, {-3, 2});
  displace(0, {1, 1});
  EXPECT_TRUE(find(4).empty());
}

/// Displaces a lamp along and across the axis of large errors of z.
TEST_F(FindOutlierLamps, ComparesErrorsToTheirCovariance) {
  const Eigen::Matrix2d axes = Eigen::Rotation2Dd(0.6).toRotationMatrix();
  const Eigen::DiagonalMatrix<double, 2> pixels_per_z(400, 20);
  seen[1].d_pixel_d_z = pixels_per_z * axes.transpose();
  const Eigen::Vector2d small_z = kSigma_px / 400 * axes.col(0),
                        large_z = kSigma_px / 20 * axes.col(1);
  const Eigen::Vector2d exact_z = seen[1].z;
  seen[1].z = exact_z + 2 * large_z;
  EXPECT_TRUE(find(7).empty());
  seen[1].z = exact_z + 15 * large_z;
  EXPECT_EQ(find(7), std::vector<std::size_t>{1});
  seen[1].z = exact_z + 15 * small_z;
  EXPECT_EQ(find(7), std::vector<std::size_t>{1});
}

TEST_F(FindOutlierLamps, AddsCommonErrorsOfEachLamp) {
  const double sd_z = kSigma_px / 400;
  displace(1, {20 * kSigma_px, 0});
  ASSERT_EQ(find(7), std::vector<std::size_t>{1});
  common[1](1, 1) = std::pow(20 * sd_z, 2);
  EXPECT_EQ(find(7), std::vector<std::size_t>{1}) << "across the error";
  common[1].setZero();
  common[1](0, 0) = std::pow(20 * sd_z, 2);
  EXPECT_TRUE(find(7).empty()) << "along the error";
  std::swap(common[1], common[2]);
  EXPECT_EQ(find(7), std::vector<std::size_t>{1}) << "of another lamp";
}

TEST_F(FindOutlierLamps, RejectsNoneWhenLampsDoNotDetermineFix) {
  for (Sighting& sighting : seen) sighting = seen[0];
  displace(1, {5, 0});
  EXPECT_TRUE(find(7).empty());
}

}  // namespace
}  // namespace vlp
