// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/outlier_rejection.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "support/matchers.h"

namespace vlp {
namespace {

const Pose kTruth{{0.1, -0.05, 0}, 0.4};

constexpr double kSigma_px = 0.05, kLevelFocal_px = 400;
const std::vector<Eigen::Vector3d> kLevelLamps_m{
    {-0.6, -0.4, 1.6}, {0.6, -0.4, 1.6},  {0.6, 0.4, 1.8}, {-0.6, 0.4, 1.6},
    {0, 0.5, 1.8},     {-0.2, -0.5, 1.7}, {0.3, 0.1, 1.6}};

/// Seven lamps, seen exactly by a level camera at the true pose.
class LevelCamera : public testing::Test {
 protected:
  std::vector<Eigen::Vector2d> points = make_points();
  std::vector<Eigen::Matrix2d> d_pixel_d_z{kLevelLamps_m.size(),
                                           kLevelFocal_px* Eigen::Matrix2d::Identity()};
  std::vector<double> sigmas_px = std::vector<double>(kLevelLamps_m.size(), kSigma_px);
  const Eigen::Vector3d no_arm_m = Eigen::Vector3d::Zero();
  const BodyPrior level = {};
  const BodyProblem problem{no_arm_m, level};

  static std::vector<Eigen::Vector2d> make_points() {
    std::vector<Eigen::Vector2d> exact;
    for (const Eigen::Vector3d& lamp_m : kLevelLamps_m)
      exact.push_back(level_point_from_world(kTruth, lamp_m).hnormalized());
    return exact;
  }
  /// Displaces a lamp in the image.
  void displace(std::size_t lamp, const Eigen::Vector2d& by_px) {
    points[lamp] += d_pixel_d_z[lamp].inverse() * by_px;
  }
  /// Returns the first `count` observations.
  std::vector<LampObservation> see(std::size_t count) const {
    std::vector<LampObservation> seen;
    for (std::size_t i = 0; i < count; ++i)
      seen.push_back(
          make_level_observation(kLevelLamps_m[i], points[i], d_pixel_d_z[i], sigmas_px[i]));
    return seen;
  }
  FrameObservations make_frame(std::size_t count, double nearest_m) const {
    FrameObservations frame;
    for (const LampObservation& seen : see(count)) frame.add_current(seen, 0, nearest_m);
    return frame;
  }
};

/// One of three lamps is displaced, so that its distance from the ray is 0.9 or 1.1 times the
/// limit.
TEST_F(LevelCamera, IsInconsistentBeyondEitherResidualLimit) {
  const auto compute_largest_distance_m = [&](double by_px) {
    points = make_points();
    displace(0, {by_px, 0});
    const auto fix = estimate_body_state(see(3), problem, {kTruth, {}});
    double largest_m = 0;
    if (!fix) return largest_m;
    const EvaluatedState body(fix->state);
    for (const LampObservation& seen : see(3)) {
      const Eigen::Vector3d q = body.lamp_position_in_body(seen.lamp_m, 0);
      largest_m = std::max(largest_m, (q - q.z() / seen.ray.z() * seen.ray).norm());
    }
    return largest_m;
  };
  const Eigen::Vector3d mean_m = (kLevelLamps_m[0] + kLevelLamps_m[1] + kLevelLamps_m[2]) / 3;
  double sum_m2 = 0;
  for (std::size_t i = 0; i < 3; ++i) sum_m2 += (kLevelLamps_m[i] - mean_m).squaredNorm();
  constexpr double fraction = 0.02, neighbor_fraction = 0.15, small_px = 0.1;
  const double distance_m_per_px = compute_largest_distance_m(small_px) / small_px;
  ASSERT_GT(distance_m_per_px, 0);
  for (const double nearest_m : {100.0, 0.05}) {
    const double limit_m =
        std::min(fraction * std::sqrt(sum_m2 / 3), neighbor_fraction * nearest_m);
    for (const auto& [factor, status] :
         {std::pair(0.9, FixStatus::ok), {1.1, FixStatus::inconsistent}}) {
      points = make_points();
      displace(0, {factor * limit_m / distance_m_per_px, 0});
      FrameObservations frame = make_frame(3, nearest_m);
      EXPECT_EQ(estimate_body_state_robust(frame, problem, fraction).status, status)
          << nearest_m << " m, " << factor;
    }
  }
}

TEST_F(LevelCamera, IsMajorityOfLampsWithinResidualLimit) {
  constexpr double fraction = 0.02, far_m = 100;
  displace(0, {40, 0});
  displace(1, {0, -60});
  FrameObservations frame = make_frame(5, far_m);
  const BodySolution found = estimate_body_state_robust(frame, problem, fraction);
  ASSERT_EQ(found.status, FixStatus::ok);
  EXPECT_EQ(frame.size, 3U);
  EXPECT_THAT(found.fix.state.pose.position_m, IsNear(kTruth.position_m, 1e-9));
  FrameObservations four = make_frame(4, far_m);
  EXPECT_EQ(estimate_body_state_robust(four, problem, fraction).status, FixStatus::inconsistent)
      << "two of four";
}

/// Lamps of a mirrored map with large errors in the direction that has almost no weight.
TEST_F(LevelCamera, IsUnderMirroredMapIfWeightedResidualsOfMirrorImageAreSmaller) {
  FrameObservations frame;
  constexpr double any_fraction = 10, far_m = 100;
  double angle_rad = 0.6, error = 0.1;
  for (const double x_m : {-0.6, -0.2, 0.3, 0.6}) {
    for (const double y_m : {-0.4, 0.1, 0.5}) {
      const Eigen::Matrix2d axes = Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
      const Eigen::Vector3d lamp_m(x_m, y_m, y_m > 0 ? 1.8 : 1.6);
      const Eigen::Vector2d z =
          level_point_from_world(kTruth, lamp_m).hnormalized() + error * axes.col(1);
      const Eigen::DiagonalMatrix<double, 2> weights(1000, 0.1), mirror(1, -1);
      frame.add_current(
          make_level_observation(lamp_m, mirror * z, weights * axes.transpose() * mirror, 0.01), 0,
          far_m);
      angle_rad += 0.7;
      error = -error;
    }
  }
  ASSERT_EQ(estimate_body_state_from_all_lamps(frame, problem).status, FixStatus::ok);
  EXPECT_EQ(estimate_body_state_robust(frame, problem, any_fraction).status,
            FixStatus::mirrored_map);
}

TEST_F(LevelCamera, IsDegenerateWhenPositionSdExceedsDistance) {
  const auto fix = estimate_body_state(see(5), problem, {kTruth, {}});
  ASSERT_TRUE(fix);
  double distance_m = 0;
  for (std::size_t i = 0; i < 5; ++i)
    distance_m += (kLevelLamps_m[i] - kTruth.position_m).norm() / 5;
  const double sd_m = std::sqrt(fix->covariance.diagonal().head<3>().maxCoeff());
  for (const auto& [factor, status] :
       {std::pair(0.98, FixStatus::ok), {1.02, FixStatus::degenerate}}) {
    std::ranges::fill(sigmas_px, kSigma_px * factor * distance_m / sd_m);
    FrameObservations frame = make_frame(5, 100);
    EXPECT_EQ(estimate_body_state_robust(frame, problem, 1).status, status) << factor;
  }
}

/// Lamps rejected if all errors are known.
class FindOutlierLamps : public LevelCamera {
 protected:
  std::vector<Matrix2> common = std::vector<Matrix2>(kLevelLamps_m.size(), Matrix2::Zero());

  /// Returns the indices of the outliers among the first `count` lamps.
  std::vector<std::size_t> find(std::size_t count) const {
    BodyFix fix{{kTruth, {}}};
    fix.covariance.diagonal().head<4>().setOnes();
    const OutlierLamps found =
        find_outlier_lamps(see(count), std::span(common).first(count), problem, fix, true);
    std::vector<std::size_t> lamps;
    for (std::size_t i = 0; i < count; ++i) {
      if (found[i]) lamps.push_back(i);
    }
    return lamps;
  }
  /// Returns the chi-squared of the least-squares fix of the first `count` lamps.
  double compute_chi_squared(std::size_t count) const {
    const auto fix = estimate_body_state(see(count), problem, {kTruth, {}});
    return fix ? fix->chi_squared : 0;
  }
};

TEST_F(FindOutlierLamps, RejectsLampBeyondQuantileOfChiSquared) {
  // Upper 1e-4 quantiles of chi-squared with 2 n - 4 degrees of freedom.
  for (const auto& [count, quantile] :
       {std::pair<std::size_t, double>(4, 23.51), {5, 27.86}, {6, 31.83}, {7, 35.56}}) {
    points = make_points();
    displace(1, {0.01, 0.02});
    const double chi_squared = compute_chi_squared(count);
    ASSERT_GT(chi_squared, 0);
    for (const auto& [factor, is_rejected] : {std::pair(0.97, false), {1.03, true}}) {
      points = make_points();
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
    points = make_points();
    sigmas_px.assign(kLevelLamps_m.size(), kSigma_px);
    sigmas_px[accurate] /= 10;
    displace(accurate, {0.8, -0.6});
    EXPECT_EQ(find(5), std::vector<std::size_t>{accurate});
  }
}

TEST_F(FindOutlierLamps, RejectsThreeOfSevenLamps) {
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
  d_pixel_d_z[1] = pixels_per_z * axes.transpose();
  const Eigen::Vector2d small_z = kSigma_px / 400 * axes.col(0),
                        large_z = kSigma_px / 20 * axes.col(1);
  const Eigen::Vector2d exact_z = points[1];
  points[1] = exact_z + 2 * large_z;
  EXPECT_TRUE(find(7).empty());
  points[1] = exact_z + 15 * large_z;
  EXPECT_EQ(find(7), std::vector<std::size_t>{1});
  points[1] = exact_z + 15 * small_z;
  EXPECT_EQ(find(7), std::vector<std::size_t>{1});
}

TEST_F(FindOutlierLamps, AddsCommonErrorsOfEachLamp) {
  displace(1, {20 * kSigma_px, 0});
  ASSERT_EQ(find(7), std::vector<std::size_t>{1});
  common[1](1, 1) = 20.0 * 20;
  EXPECT_EQ(find(7), std::vector<std::size_t>{1}) << "across the error";
  common[1].setZero();
  common[1](0, 0) = 20.0 * 20;
  EXPECT_TRUE(find(7).empty()) << "along the error";
  std::swap(common[1], common[2]);
  EXPECT_EQ(find(7), std::vector<std::size_t>{1}) << "of another lamp";
}

TEST_F(FindOutlierLamps, RejectsNoneWhenLampsDoNotDetermineFix) {
  BodyFix fix{{kTruth, {}}};
  fix.covariance.diagonal().setOnes();  // motion and tilt are free, too
  displace(1, {5, 0});
  EXPECT_TRUE(find_outlier_lamps(see(4), std::span(common).first(4), problem, fix, true).none());
}

}  // namespace
}  // namespace vlp
