// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Least-squares states of bodies from observations with given rays, without a lens.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "geometry/angles.h"
#include "positioning/body_solution.h"
#include "positioning/outlier_rejection.h"
#include "positioning/pose_estimation.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Focal length of the observations, px per rad.
constexpr double kFocal_px = 500;
const Eigen::Vector3d kArm_m(0.2, -0.1, 0.3);
const std::vector<Eigen::Vector3d> kLamps_m{{-0.8, -0.5, 2.1}, {0.9, -0.4, 2.0}, {0.7, 0.6, 2.4},
                                            {-0.6, 0.7, 2.2},  {0.1, 0.2, 2.6},  {0.2, -0.9, 2.3}};

/// Returns the state whose components differ from `state` by `step` (order of BodyIndex).
BodyState add_step(BodyState state, const Eigen::Matrix<double, kBodyStates, 1>& step) {
  state.pose.position_m += step.head<3>();
  state.pose.yaw_rad += step[3];
  state.motion.velocity_m_per_s += step.segment<2>(4);
  state.motion.yaw_rate_rad_per_s += step[6];
  state.motion.inclination.roll_rad += step[7];
  state.motion.inclination.pitch_rad += step[8];
  return state;
}

/// Returns the observation of a lamp by a body, displaced by `error_px` along two directions
/// across the ray.
LampObservation observe_lamp(const BodyState& state, const Eigen::Vector3d& lamp_m, double time_s,
                             double sigma_px, const Eigen::Vector2d& error_px) {
  const Eigen::Vector3d exact_ray =
      (EvaluatedState(state).lamp_position_in_body(lamp_m, time_s) - kArm_m).normalized();
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = exact_ray.unitOrthogonal();
  across.col(1) = exact_ray.cross(Eigen::Vector3d(across.col(0)));
  const Eigen::Vector3d ray = (exact_ray + across * error_px / kFocal_px).normalized();
  across.col(0) = ray.unitOrthogonal();
  across.col(1) = ray.cross(Eigen::Vector3d(across.col(0)));
  const Eigen::Matrix<double, 2, 3> whitened = kFocal_px / sigma_px * across.transpose();
  return {lamp_m, ray, whitened, sigma_px, time_s};
}

/// Observations of all lamps by a body that moves, rotates and is tilted.
class BodyStateEstimation : public testing::Test {
 protected:
  BodyState truth{{{0.1, -0.2, 0.05}, 0.7}, {{0.4, -0.3}, 0.5, {0.06, -0.08}}};
  BodyPrior prior = make_prior();
  std::vector<LampObservation> seen = observe(0);

  BodyPrior make_prior() const {
    BodyPrior known;
    known.mean.motion = truth.motion;
    return known;
  }
  /// Returns the observations with errors of up to `error_px`.
  std::vector<LampObservation> observe(double error_px) const {
    std::vector<LampObservation> observations;
    for (std::size_t i = 0; i < kLamps_m.size(); ++i) {
      const auto n = static_cast<double>(i);
      const Eigen::Vector2d direction(std::sin(2 * n), std::cos(3 * n));
      observations.push_back(observe_lamp(truth, kLamps_m[i], 0.004 * n - 0.008, 0.1 + 0.05 * n,
                                          error_px * direction));
    }
    return observations;
  }
  FrameObservations make_frame() const {
    FrameObservations frame;
    for (const LampObservation& observation : seen) {
      frame.add_current(observation, 10 + static_cast<int>(frame.size), 10);
    }
    return frame;
  }
  void estimate_all_states() {
    prior.set_sd(kBodyVelocity, 0.2);
    prior.mean.motion.velocity_m_per_s += Eigen::Vector2d(0.1, 0.05);
    prior.set_sd(kBodyYawRate, 0.3);
    prior.mean.motion.yaw_rate_rad_per_s -= 0.2;
    prior.set_sd(kBodyRoll, 0.02);
    prior.mean.motion.inclination.roll_rad += 0.01;
    prior.mean.pose.position_m.z() = truth.pose.position_m.z() + 0.002;
    prior.set_sd(kBodyZ, 0.003);
  }
  double compute_chi_squared(const BodyState& state) const {
    return compute_body_state_chi_squared(seen, {kArm_m, prior}, state).value_or(-1);
  }
};

TEST_F(BodyStateEstimation, ReturnsTruthWithoutNoise) {
  BodyState start = truth;
  start.pose.position_m += Eigen::Vector3d(0.3, -0.2, -0.4);
  start.pose.yaw_rad -= 0.5;
  const auto fix = estimate_body_state(seen, {kArm_m, prior}, start);
  ASSERT_TRUE(fix);
  EXPECT_THAT(fix->state.pose.position_m, IsNear(truth.pose.position_m, 1e-12));
  EXPECT_NEAR(fix->state.pose.yaw_rad, truth.pose.yaw_rad, 1e-12);
  EXPECT_NEAR(fix->chi_squared, 0, 1e-6);
  EXPECT_NEAR(fix->residual_px, 0, 1e-4);
  EXPECT_NEAR(fix->redundancy, 2 * static_cast<double>(seen.size()) - 4, 1e-9);
}

TEST_F(BodyStateEstimation, ReturnsNulloptWhenStartIsAboveSomeLamps) {
  BodyState start = truth;
  start.pose.position_m.z() += 2.05;  // the camera is then at 2.4 m, the lamps at 2.0 to 2.6 m
  EXPECT_FALSE(estimate_body_state(seen, {kArm_m, prior}, start));
}

/// The first full step from far below leads above the lamps, and is halved.
TEST_F(BodyStateEstimation, ConvergesFromStartFarBelow) {
  for (const double below_m : {3.0, 6.0, 12.0}) {
    BodyState start = truth;
    start.pose.position_m.z() -= below_m;
    const auto fix = estimate_body_state(seen, {kArm_m, prior}, start);
    ASSERT_TRUE(fix) << below_m;
    EXPECT_THAT(fix->state.pose.position_m, IsNear(truth.pose.position_m, 1e-9)) << below_m;
  }
}

TEST_F(BodyStateEstimation, ReturnsYawBetweenMinusPiAndPi) {
  BodyState start = truth;
  start.pose.yaw_rad += 4 * std::numbers::pi;
  const auto fix = estimate_body_state(seen, {kArm_m, prior}, start);
  ASSERT_TRUE(fix);
  EXPECT_NEAR(fix->state.pose.yaw_rad, truth.pose.yaw_rad, 1e-12);
}

/// Compares the fix with the minimum of chi-squared, found by finite differences.
TEST_F(BodyStateEstimation, MinimizesChiSquaredOfPixelsAndPriors) {
  seen = observe(0.3);
  estimate_all_states();
  const auto fix = estimate_body_state(seen, {kArm_m, prior}, truth);
  ASSERT_TRUE(fix);
  EXPECT_NEAR(fix->chi_squared, compute_chi_squared(fix->state), 1e-5);
  ASSERT_GT(fix->chi_squared, 1);
  Eigen::Matrix<double, kBodyStates, kBodyStates> hessian;
  using Vector = Eigen::Matrix<double, kBodyStates, 1>;
  const Vector sds = fix->covariance.diagonal().cwiseSqrt();
  ASSERT_GT(sds.minCoeff(), 0);
  for (int i = 0; i < kBodyStates; ++i) {
    const Vector step = 1e-3 * sds[i] * Vector::Unit(i);
    const double slope = compute_chi_squared(add_step(fix->state, step)) -
                         compute_chi_squared(add_step(fix->state, -step));
    EXPECT_NEAR(slope, 0, 1e-6) << "state " << i;
    for (int k = 0; k < kBodyStates; ++k) {
      const Vector a = 0.1 * sds[i] * Vector::Unit(i), b = 0.1 * sds[k] * Vector::Unit(k);
      hessian(i, k) = (compute_chi_squared(add_step(fix->state, a + b)) -
                       compute_chi_squared(add_step(fix->state, a - b)) -
                       compute_chi_squared(add_step(fix->state, b - a)) +
                       compute_chi_squared(add_step(fix->state, -a - b))) /
                      (4 * 0.01 * sds[i] * sds[k]);
    }
  }
  // Chi-squared has the Hessian 2 J^T J, but for the curvature of the residuals.
  const Eigen::Matrix<double, kBodyStates, kBodyStates> covariance = (hessian / 2).inverse();
  for (int i = 0; i < kBodyStates; ++i) {
    for (int k = 0; k < kBodyStates; ++k) {
      EXPECT_NEAR(fix->covariance(i, k) / (sds[i] * sds[k]), covariance(i, k) / (sds[i] * sds[k]),
                  0.02)
          << i << ' ' << k;
    }
  }
}

TEST_F(BodyStateEstimation, SeparatesResidualsOfPixelsFromPriors) {
  seen = observe(0.3);
  estimate_all_states();
  const auto fix = estimate_body_state(seen, {kArm_m, prior}, truth);
  ASSERT_TRUE(fix);
  double chi_squared = 0, sum_px2 = 0;
  const EvaluatedState at(fix->state);
  for (const LampObservation& observation : seen) {
    const Eigen::Vector3d q =
        at.lamp_position_in_body(observation.lamp_m, observation.time_s) - kArm_m;
    const Eigen::Vector2d residual =
        observation.whitened_pixel_from_ray * q / observation.ray.dot(q);
    chi_squared += residual.squaredNorm();
    sum_px2 += (observation.sigma_px * residual).squaredNorm();
  }
  ASSERT_GT(chi_squared, 0);
  EXPECT_NEAR(fix->pixels_chi_squared, chi_squared, 1e-5);
  EXPECT_GT(fix->chi_squared, chi_squared + 0.1) << "the priors have residuals";
  EXPECT_NEAR(fix->residual_px, std::sqrt(sum_px2 / static_cast<double>(seen.size())), 1e-6);
}

/// The expectation of chi-squared of n pixels is 2 n - trace(J C J^T), here with J from finite
/// differences.
TEST_F(BodyStateEstimation, RedundancyIsExpectedChiSquaredOfPixels) {
  for (const bool are_all_estimated : {false, true}) {
    if (are_all_estimated) estimate_all_states();
    const auto fix = estimate_body_state(seen, {kArm_m, prior}, truth);
    ASSERT_TRUE(fix);
    double trace = 0;
    for (const LampObservation& observation : seen) {
      Eigen::Matrix<double, 2, kBodyStates> jacobian;
      for (int i = 0; i < kBodyStates; ++i) {
        constexpr double step = 1e-6;
        const auto residual = [&](double by) {
          const EvaluatedState at(
              add_step(fix->state, by * Eigen::Matrix<double, kBodyStates, 1>::Unit(i)));
          const Eigen::Vector3d q =
              at.lamp_position_in_body(observation.lamp_m, observation.time_s) - kArm_m;
          return Eigen::Vector2d(observation.whitened_pixel_from_ray * q / observation.ray.dot(q));
        };
        jacobian.col(i) = (residual(step) - residual(-step)) / (2 * step);
      }
      trace += (jacobian * fix->covariance * jacobian.transpose()).trace();
    }
    ASSERT_GT(trace, 1);
    EXPECT_NEAR(fix->redundancy, 2 * static_cast<double>(seen.size()) - trace, 1e-3)
        << are_all_estimated;
  }
}

TEST_F(BodyStateEstimation, StatesWithoutPriorSdStayAtTheirMean) {
  seen = observe(0.3);
  prior.set_sd(kBodyYawRate, 0.3);
  const auto fix = estimate_body_state(seen, {kArm_m, prior}, truth);
  ASSERT_TRUE(fix);
  EXPECT_NE(fix->state.motion.yaw_rate_rad_per_s, truth.motion.yaw_rate_rad_per_s);
  EXPECT_EQ(fix->state.motion.velocity_m_per_s, truth.motion.velocity_m_per_s);
  EXPECT_EQ(fix->state.motion.inclination.roll_rad, truth.motion.inclination.roll_rad);
  EXPECT_EQ(fix->state.motion.inclination.pitch_rad, truth.motion.inclination.pitch_rad);
  EXPECT_GT(fix->covariance(6, 6), 0);
  for (const int fixed : {4, 5, 7, 8}) {
    EXPECT_EQ(fix->covariance.row(fixed).cwiseAbs().sum(), 0) << fixed;
    EXPECT_EQ(fix->covariance.col(fixed).cwiseAbs().sum(), 0) << fixed;
  }
}

TEST_F(BodyStateEstimation, ReturnsNulloptForOneLamp) {
  seen.resize(1);
  EXPECT_FALSE(estimate_body_state(seen, {kArm_m, prior}, truth));
}

/// Three lamps with free roll and pitch, which have several solutions. Their chi-squared differs by
/// the residual of the known height only, as the pixels have almost no noise.
class EstimateBodyStateFromThreeLamps : public BodyStateEstimation {
 protected:
  /// Heights of the solutions, in ascending order.
  std::vector<double> heights_m;

  void SetUp() override {
    truth.motion = {{0, 0}, 0, truth.motion.inclination};
    prior.mean.motion = truth.motion;
    seen = observe(0);
    seen.erase(seen.begin(), seen.begin() + 3);
    for (LampObservation& observation : seen) observation.whitened_pixel_from_ray *= 1e4;
    constexpr double unknown = 1e3;
    prior.set_sd(kBodyRoll, unknown);
    const InitialStates states =
        compute_initial_body_states_from_three_lamps(make_frame(), {0, 1, 2}, {kArm_m, prior});
    ASSERT_GE(states.count, 2);
    for (std::size_t i = 0; i < static_cast<std::size_t>(states.count); ++i) {
      heights_m.push_back(states.states[i].pose.position_m.z());
    }
    std::ranges::sort(heights_m);
    ASSERT_GT(heights_m[1] - heights_m[0], 0.1);
  }
  /// Returns the status with a prior height below the lowest solution, by `height_in_gaps` times
  /// the difference to the next one. This difference is `gap_in_sds` standard deviations.
  FixStatus find_status(double height_in_gaps, double gap_in_sds) {
    const double gap_m = heights_m[1] - heights_m[0];
    prior.mean.pose.position_m.z() = heights_m[0] - height_in_gaps * gap_m;
    prior.set_sd(kBodyZ, gap_m / gap_in_sds);
    return estimate_body_state_from_all_lamps(make_frame(), {kArm_m, prior}).status;
  }
};

TEST_F(EstimateBodyStateFromThreeLamps, IsAmbiguousIfChiSquaredDiffersByLessThan12) {
  EXPECT_EQ(find_status(0, std::sqrt(11.8)), FixStatus::ambiguous);
  EXPECT_EQ(find_status(0, std::sqrt(12.2)), FixStatus::ok);
}

/// The smaller chi-squared c exceeds its two degrees of freedom: the limit is 12 c / 2.
TEST_F(EstimateBodyStateFromThreeLamps, ScalesLimitOfAmbiguityByReducedChiSquared) {
  // c = h^2 u, and the difference is (1 + 2 h) u: equal to the limit at h = (1 + sqrt(7)) / 6.
  constexpr double gap_in_sds = 30, height_at_limit = 0.6076;
  EXPECT_EQ(find_status(height_at_limit + 0.02, gap_in_sds), FixStatus::ambiguous);
  EXPECT_EQ(find_status(height_at_limit - 0.02, gap_in_sds), FixStatus::ok);
}

/// Tests of estimate_body_state_robust() with the same observations.
class EstimateBodyStateRobust : public BodyStateEstimation {
 protected:
  static constexpr double kMaxResidualFraction = 0.1;

  /// Displaces the observation of a lamp.
  void displace(std::size_t lamp, const Eigen::Vector2d& error_px) {
    seen[lamp] =
        observe_lamp(truth, kLamps_m[lamp], seen[lamp].time_s, seen[lamp].sigma_px, error_px);
  }
  /// Estimates the state and rejects the lamps that the noise does not explain.
  BodySolution reject_by_noise(FrameObservations& frame) const {
    const BodyProblem problem{kArm_m, prior};
    const BodySolution all = estimate_body_state_robust(frame, problem, kMaxResidualFraction);
    EXPECT_EQ(all.status, FixStatus::ok);
    const std::vector<Matrix2> no_common(frame.size, Matrix2::Zero());
    const auto outliers =
        find_outlier_lamps(frame.observations_span(), no_common, problem, all.fix, false);
    return reject_outlier_lamps(frame, outliers, problem, all);
  }
  static std::vector<int> list_rejected_ids(const FrameObservations& frame) {
    return {frame.rejected_ids.begin(), frame.rejected_ids.begin() + frame.rejected_lamps};
  }
};

TEST_F(EstimateBodyStateRobust, RejectsLampWithResidualAboveNoise) {
  for (std::size_t lamp = 0; lamp < seen.size(); ++lamp) {
    seen = observe(0);
    displace(lamp, {12, -9});
    FrameObservations frame = make_frame();
    const BodySolution solution = reject_by_noise(frame);
    ASSERT_EQ(solution.status, FixStatus::ok) << lamp;
    EXPECT_EQ(list_rejected_ids(frame), std::vector<int>{10 + static_cast<int>(lamp)});
    EXPECT_EQ(frame.size, seen.size() - 1);
    EXPECT_THAT(solution.fix.state.pose.position_m, IsNear(truth.pose.position_m, 1e-9)) << lamp;
    EXPECT_NEAR(solution.fix.chi_squared, 0, 1e-6);
  }
}

TEST_F(EstimateBodyStateRobust, RejectsTwoOfSixLampsWithResidualsAboveNoise) {
  displace(1, {12, -9});
  displace(3, {-5, -6});
  FrameObservations frame = make_frame();
  const BodySolution solution = reject_by_noise(frame);
  ASSERT_EQ(solution.status, FixStatus::ok);
  EXPECT_EQ(list_rejected_ids(frame), (std::vector<int>{11, 13}));
  EXPECT_THAT(solution.fix.state.pose.position_m, IsNear(truth.pose.position_m, 1e-9));
}

TEST_F(EstimateBodyStateRobust, KeepsAllLampsWithoutMajority) {
  displace(0, {12, -9});
  displace(1, {-13, 10});
  displace(4, {14, 12});
  FrameObservations frame = make_frame();
  const BodySolution solution = reject_by_noise(frame);
  EXPECT_EQ(solution.status, FixStatus::ok);
  EXPECT_EQ(frame.size, seen.size());
  EXPECT_EQ(frame.rejected_lamps, 0);
}

TEST_F(EstimateBodyStateRobust, RejectsMisidentifiedLampBeyondResidualLimit) {
  displace(3, {160, 120});
  FrameObservations frame = make_frame();
  const BodySolution solution =
      estimate_body_state_robust(frame, {kArm_m, prior}, kMaxResidualFraction);
  ASSERT_EQ(solution.status, FixStatus::ok);
  EXPECT_EQ(list_rejected_ids(frame), std::vector<int>{13});
  EXPECT_THAT(solution.fix.state.pose.position_m, IsNear(truth.pose.position_m, 1e-9));
}

/// The state of the majority is first estimated at rest. The motion displaces lamps by up to 30 mm,
/// and the limit of the residuals is 0.15 * 80 mm.
TEST_F(EstimateBodyStateRobust, RejectsMisidentifiedLampOfDrivingCamera) {
  truth.motion.velocity_m_per_s = {2, -1.5};
  seen = observe(0);
  prior.set_sd(kBodyVelocity, 1);
  displace(3, {160, 120});
  FrameObservations frame = make_frame();
  frame.nearest_m.fill(0.08);
  const BodySolution solution =
      estimate_body_state_robust(frame, {kArm_m, prior}, kMaxResidualFraction);
  ASSERT_EQ(solution.status, FixStatus::ok);
  EXPECT_EQ(list_rejected_ids(frame), std::vector<int>{13});
  EXPECT_THAT(solution.fix.state.pose.position_m, IsNear(truth.pose.position_m, 1e-3));
}

/// Without one of three lamps, two remain, which cannot be checked.
TEST_F(EstimateBodyStateRobust, ReturnsInconsistentForOutlierAmongThreeLamps) {
  seen.resize(3);
  displace(0, {160, 120});
  FrameObservations frame = make_frame();
  EXPECT_EQ(estimate_body_state_robust(frame, {kArm_m, prior}, kMaxResidualFraction).status,
            FixStatus::inconsistent);
}

/// The motion differs from the prior by more or less than five standard deviations.
TEST_F(EstimateBodyStateRobust, ReturnsInconsistentBeyondFiveSdsOfPrior) {
  for (LampObservation& observation : seen) observation.whitened_pixel_from_ray *= 1000;
  for (const auto& [sds, status] :
       {std::pair(4.9, FixStatus::ok), {5.1, FixStatus::inconsistent}}) {
    BodyPrior moving = prior;
    moving.set_sd(kBodyVelocity, 0.05);
    moving.mean.motion.velocity_m_per_s.y() = truth.motion.velocity_m_per_s.y() - sds * 0.05;
    FrameObservations frame = make_frame();
    EXPECT_EQ(estimate_body_state_robust(frame, {kArm_m, moving}, kMaxResidualFraction).status,
              status)
        << "velocity, " << sds;
    BodyPrior rotating = prior;
    rotating.set_sd(kBodyYawRate, 0.1);
    rotating.mean.motion.yaw_rate_rad_per_s = truth.motion.yaw_rate_rad_per_s + sds * 0.1;
    frame = make_frame();
    EXPECT_EQ(estimate_body_state_robust(frame, {kArm_m, rotating}, kMaxResidualFraction).status,
              status)
        << "yaw rate, " << sds;
    BodyPrior tilted = prior;
    tilted.set_sd(kBodyRoll, 0.01);
    tilted.mean.motion.inclination.roll_rad = truth.motion.inclination.roll_rad - 0.6 * sds * 0.01;
    tilted.mean.motion.inclination.pitch_rad =
        truth.motion.inclination.pitch_rad + 0.8 * sds * 0.01;
    frame = make_frame();
    EXPECT_EQ(estimate_body_state_robust(frame, {kArm_m, tilted}, kMaxResidualFraction).status,
              status)
        << "tilt, " << sds;
  }
}

}  // namespace
}  // namespace vlp
