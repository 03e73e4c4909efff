// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/error_budget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "positioning/positioner.h"
#include "support/body_rig.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

std::vector<Eigen::Vector3d> get_lamp_positions(const LampMap& map) {
  std::vector<Eigen::Vector3d> positions_m;
  for (const Lamp& lamp : map.lamps) positions_m.push_back(lamp.position_m);
  return positions_m;
}

TEST(ComputeFixBudget, NoiseTermMatchesFormulaForPinholeAndEqualHeights) {
  const double focal_px = 520, sigma_px = 0.3;
  const Lens lens(LensModel::pinhole, std::array{focal_px, focal_px, 400.0, 300.0});
  for (const std::size_t n : {2u, 3u, 5u, 8u}) {
    auto lamps_m = get_lamp_positions(synthetic_lamps());
    lamps_m.resize(n);
    const Pose pose{{0.4, -0.7, 0.25}, 1.1};
    const Eigen::Vector3d mean =
        std::accumulate(lamps_m.begin(), lamps_m.end(), Eigen::Vector3d(0, 0, 0)) /
        static_cast<double>(n);
    double spread = 0;
    for (const auto& lamp_m : lamps_m) spread += (lamp_m - mean).squaredNorm();
    const double height_m = 1.6 - 0.25, unit_m = height_m / focal_px * sigma_px;
    const double d = (mean - pose.position_m).head<2>().norm();
    const auto budget = compute_fix_budget(lamps_m, lens, pose, {sigma_px, 0, 0, 0});
    ASSERT_TRUE(budget);
    const double horizontal_m = unit_m * std::sqrt(1 / static_cast<double>(n) + d * d / spread);
    const Eigen::Vector4d expected(horizontal_m, horizontal_m,
                                   height_m * unit_m / std::sqrt(spread),
                                   unit_m / std::sqrt(spread));
    EXPECT_THAT(Eigen::Vector4d(budget->noise.diagonal().cwiseSqrt()), IsNear(expected, 1e-12));
  }
}

TEST(ComputeFixBudget, ReturnsNulloptWithoutTwoLampsInFrontOfLens) {
  const Lens lens(LensModel::pinhole, std::array{520.0, 520.0, 400.0, 300.0});
  const ErrorSources noise{0.1, 0, 0, 0};
  const std::vector<Eigen::Vector3d> lamps_m{{0, 0, 2}, {1, 0, 2}};
  EXPECT_FALSE(compute_fix_budget({lamps_m.data(), 1}, lens, {{0, 0, 0}, 0}, noise));
  EXPECT_FALSE(compute_fix_budget(lamps_m, lens, {{0, 0, 2.5}, 0}, noise));
  EXPECT_TRUE(compute_fix_budget(lamps_m, lens, {{0, 0, 0}, 0}, noise));
}

/// Free states of a camera that is level and at rest: one or all.
struct FreeStates {
  bool drive, turn, lean;
};

class ErrorBudgetWithPrior : public testing::TestWithParam<FreeStates> {
 protected:
  static constexpr double kNoise_px = 0.1;
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {{{0.1, -0.05, 0.05}, 0.7}, {}}, {}};
  ErrorSources sources{kNoise_px, 0.5, 0.002, 0.001};

  static BodyPrior prior(const FreeStates& may) {
    BodyPrior prior;
    prior.set_state_sd(kBodyVelocity, may.drive ? 1 : 0);
    prior.set_state_sd(kBodyYawRate, may.turn ? 1.5 : 0);
    prior.set_state_sd(kBodyRoll, may.lean ? 0.1 : 0);
    return prior;
  }
  Sensors sensors() const {
    const BodyPrior known = prior(GetParam());
    Sensors sensors;
    sensors.motion = {{0, 0},
                      0,
                      std::sqrt(known.max_variance(kBodyVelocity, 2)),
                      std::sqrt(known.max_variance(kBodyYawRate, 1))};
    sensors.inclination_sigma_rad = std::sqrt(known.max_variance(kBodyRoll, 2));
    return sensors;
  }
  std::optional<ErrorBudget> budget(const BodyPrior& prior) const {
    const Camera& camera = rig.calibration.camera;
    return compute_fix_budget(get_lamp_positions(rig.map),
                              Lens(camera.lens_model, camera.intrinsics), rig.body.pose, sources,
                              prior, make_readout_clock(camera));
  }
  Eigen::Vector4d locate(const BodyRig& with, const std::vector<Detection>& detections) const {
    const Fix fix = with.positioner().compute_position_fix(detections, sensors());
    EXPECT_TRUE(fix.has_succeeded());
    Eigen::Vector4d state;
    state << fix.state.pose.position_m, fix.state.pose.yaw_rad;
    return state;
  }
  /// Returns the central difference of a fix with an error of `step`.
  template <typename With>
  Eigen::Vector4d per_step(double step, const With& with) const {
    return (with(step) - with(-step)) / (2 * step);
  }
  static void expect_close(const Matrix4& found, const Eigen::Matrix4d& expected,
                           double tolerance) {
    const Eigen::Vector4d sd = expected.diagonal().cwiseMax(1e-20).cwiseSqrt();
    EXPECT_LT((found - expected).cwiseQuotient(sd * sd.transpose()).cwiseAbs().maxCoeff(),
              tolerance)
        << found << "\n\n"
        << expected;
  }
};

TEST_P(ErrorBudgetWithPrior, NoiseMotionAndRollPitchTermsSumToFixCovariance) {
  const Fix fix = rig.positioner().compute_position_fix(seen_from(rig, kNoise_px), sensors());
  ASSERT_TRUE(fix.has_succeeded());
  const auto found = budget(prior(GetParam()));
  ASSERT_TRUE(found);
  expect_close(found->noise + found->motion + found->roll_pitch,
               Matrix4(fix.noise_covariance.topLeftCorner<4, 4>()), 1e-6);
  const auto& [drive, turn, lean] = GetParam();
  EXPECT_EQ(found->motion.diagonal().minCoeff() > 0, drive || turn);
  EXPECT_EQ(found->roll_pitch.diagonal().maxCoeff() > 1e-12, lean);
  EXPECT_THAT(found->total_pose_covariance(),
              IsNear(Matrix4(found->noise + found->motion + found->roll_pitch + found->center +
                             found->tilt + found->lamp_map),
                     1e-15));
}

/// The effects of single errors on fixes match the budget.
TEST_P(ErrorBudgetWithPrior, PrincipalPointTiltAndLampMapTermsMatchErrorsOfFixes) {
  const auto found = budget(prior(GetParam()));
  ASSERT_TRUE(found);
  const auto exact = seen_from(rig, kNoise_px);
  ASSERT_FALSE(exact.empty());
  Eigen::Matrix4d by_center = Eigen::Matrix4d::Zero(), by_tilt = by_center, by_lamps = by_center;
  for (const int axis : {0, 1}) {
    const Eigen::Vector4d shift = per_step(0.01, [&](double step_px) {
      auto shifted = exact;
      for (Detection& detection : shifted) detection.pixel[axis] += step_px;
      return locate(rig, shifted);
    });
    by_center += std::pow(sources.center_px, 2) * shift * shift.transpose();
    const Eigen::Vector4d turn = per_step(1e-4, [&](double step_rad) {
      BodyRig leaning = rig;
      leaning.calibration.rotation_center =
          tilted_by(rig.calibration.camera, step_rad, axis * M_PI / 2);
      return locate(leaning, exact);
    });
    by_tilt += std::pow(sources.tilt_rad, 2) * turn * turn.transpose();
  }
  for (std::size_t lamp = 0; lamp < rig.map.lamps.size(); ++lamp) {
    for (const int axis : {0, 1, 2}) {
      const Eigen::Vector4d move = per_step(1e-4, [&](double step_m) {
        BodyRig wrong = rig;
        wrong.map.lamps[lamp].position_m[axis] += step_m;
        return locate(wrong, exact);
      });
      by_lamps += std::pow(sources.lamp_map_m, 2) * move * move.transpose();
    }
  }
  // Errors of second order in the steps. Two errors change four states: yaw and height barely.
  const Eigen::Vector4d scale = found->total_pose_covariance().diagonal().cwiseSqrt();
  const auto relative = [&](const Eigen::Matrix4d& difference) {
    return difference.cwiseQuotient(scale * scale.transpose()).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(relative(found->center - by_center), 1e-3);
  EXPECT_LT(relative(found->tilt - by_tilt), 1e-3);
  EXPECT_LT(relative(found->lamp_map - by_lamps), 1e-3);
}

std::string name_of_what_it_may(const testing::TestParamInfo<FreeStates>& one) {
  const auto& [drive, turn, lean] = one.param;
  return std::string(drive ? "Drive" : "") + (turn ? "Turn" : "") + (lean ? "Lean" : "");
}

INSTANTIATE_TEST_SUITE_P(
    FreeStates, ErrorBudgetWithPrior,
    testing::Values(FreeStates{true, false, false}, FreeStates{false, true, false},
                    FreeStates{true, true, false}, FreeStates{false, false, true},
                    FreeStates{true, false, true}, FreeStates{true, true, true}),
    name_of_what_it_may);

class ErrorBudgetPriorCases : public ErrorBudgetWithPrior {};

TEST_F(ErrorBudgetPriorCases, EqualsBudgetOfStandingCameraWhenPriorIsTight) {
  BodyPrior prior;
  prior.set_state_sd(kBodyVelocity, 1e-7);
  prior.set_state_sd(kBodyRoll, 1e-7);
  const auto found = budget(prior);
  const Camera& camera = rig.calibration.camera;
  const auto standing =
      compute_fix_budget(get_lamp_positions(rig.map), Lens(camera.lens_model, camera.intrinsics),
                         rig.body.pose, sources);
  ASSERT_TRUE(found && standing);
  expect_close(found->noise, standing->noise, 1e-6);
  expect_close(found->total_pose_covariance(), standing->total_pose_covariance(), 1e-6);
}

TEST_F(ErrorBudgetPriorCases, ReturnsNulloptForTwoOrCollinearLampsWithFreeTilt) {
  BodyPrior in_hand;
  in_hand.set_state_sd(kBodyRoll, 1.6);
  rig.map.lamps.resize(2);
  EXPECT_TRUE(budget(prior({true, true, false})));
  EXPECT_FALSE(budget(in_hand));
  rig.map = make_lamp_map({{-0.6, 0.2, 1.6}, {0, 0.2, 1.6}, {0.6, 0.2, 1.6}});
  EXPECT_FALSE(budget(in_hand));
}

}  // namespace
}  // namespace vlp
