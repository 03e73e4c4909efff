// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/error_budget.h"

#include <gtest/gtest.h>

#include <numeric>

#include "positioning/positioner.h"
#include "support/near.h"
#include "support/scatter.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

std::vector<Eigen::Vector3d> positions_of(const LampMap& map) {
  std::vector<Eigen::Vector3d> positions_m;
  for (const Lamp& lamp : map.lamps) positions_m.push_back(lamp.position_m);
  return positions_m;
}

TEST(ErrorBudget, IsTheFormulaOfTheTheoryForLampsAtOneHeightUnderAPinhole) {
  const double focal_px = 520, sigma_px = 0.3;
  const Lens lens(LensModel::pinhole, std::array{focal_px, focal_px, 400.0, 300.0});
  for (const std::size_t n : {2u, 3u, 5u, 8u}) {
    auto lamps_m = positions_of(synthetic_lamps());
    lamps_m.resize(n);
    const Pose pose{{0.4, -0.7, 0.25}, 1.1};
    const Eigen::Vector3d mean =
        std::accumulate(lamps_m.begin(), lamps_m.end(), Eigen::Vector3d(0, 0, 0)) /
        static_cast<double>(n);
    double spread = 0;
    for (const auto& lamp_m : lamps_m) spread += (lamp_m - mean).squaredNorm();
    const double height_m = 1.6 - 0.25, unit_m = height_m / focal_px * sigma_px;
    const double d = (mean - pose.position_m).head<2>().norm();
    const auto budget = error_budget(lamps_m, lens, pose, {sigma_px, 0, 0, 0});
    ASSERT_TRUE(budget);
    const double horizontal_m = unit_m * std::sqrt(1 / static_cast<double>(n) + d * d / spread);
    const Eigen::Vector4d expected(horizontal_m, horizontal_m,
                                   height_m * unit_m / std::sqrt(spread),
                                   unit_m / std::sqrt(spread));
    EXPECT_THAT(Eigen::Vector4d(budget->noise.diagonal().cwiseSqrt()), IsNear(expected, 1e-12));
  }
}

/// Draws each source's error alone and fixes with it: the fix scatters as the budget says.
class BudgetTerm : public testing::Test {
 protected:
  SyntheticRig rig{
      synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.1, 0.2, 0}, 0.5}, {}};
  Random random{21};
  static constexpr int kDraws = 20000;

  ErrorBudget budget(const ErrorSources& sources) {
    const Camera& camera = rig.calibration.camera;
    return *error_budget(positions_of(rig.map), Lens(camera.lens_model, camera.intrinsics),
                         rig.camera, sources);
  }

  /// Unit weights, as the budget assumes.
  template <typename Draw>
  void expect_scatter(const Eigen::Matrix4d& covariance, const Draw& draw) {
    const auto exact = seen_from(rig);
    Scatter scatter(rig.camera, covariance);
    for (int i = 0; i < kDraws; ++i) scatter.add(draw(exact).estimate.pose);
    EXPECT_LT(scatter.excess().cwiseAbs().maxCoeff(), 0.03) << scatter.excess().transpose();
  }
};

TEST_F(BudgetTerm, OfTheCentreIsTheScatter) {
  rig.map.lamps.resize(3);
  const Positioner positioner(rig.map, rig.calibration);
  // The four-parameter covariance of two causes is singular; yaw and height hardly move.
  Eigen::Matrix4d covariance = budget({1, 0.5, 0, 0}).center;
  const auto exact = seen_from(rig);
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    auto shifted = exact;
    const Eigen::Vector2d shift = 0.5 * Eigen::Vector2d(random.normal(), random.normal());
    for (Detection& detection : shifted) detection.pixel += shift;
    const Pose pose = positioner.locate(shifted).estimate.pose;
    Eigen::Vector4d error;
    error << pose.position_m - rig.camera.position_m, pose.yaw_rad - rig.camera.yaw_rad;
    sum += error * error.transpose();
  }
  EXPECT_LT((sum / kDraws - covariance).norm(), 0.05 * covariance.norm());
}

TEST_F(BudgetTerm, OfTheTiltIsTheScatter) {
  const Positioner positioner(rig.map, rig.calibration);
  const Eigen::Matrix4d covariance = budget({1, 0, 0.003, 0}).tilt;
  const auto exact = seen_from(rig);
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Inclination wrong{0.003 * random.normal(), 0.003 * random.normal()};
    const Pose pose = positioner.locate(exact, {wrong, 0, {}}).estimate.pose;
    Eigen::Vector4d error;
    error << pose.position_m - rig.camera.position_m, pose.yaw_rad - rig.camera.yaw_rad;
    sum += error * error.transpose();
  }
  EXPECT_LT((sum / kDraws - covariance).norm(), 0.05 * covariance.norm());
}

TEST_F(BudgetTerm, OfTheLampMapIsTheScatter) {
  expect_scatter(budget({1, 0, 0, 0.004}).lamp_map, [&](const auto& exact) {
    LampMap wrong = rig.map;
    for (Lamp& lamp : wrong.lamps) {
      lamp.position_m += 0.004 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    }
    return Positioner(wrong, rig.calibration).locate(exact);
  });
}

TEST_F(BudgetTerm, OfTheNoiseIsTheScatter) {
  const Positioner positioner(rig.map, rig.calibration);
  expect_scatter(budget({0.4, 0, 0, 0}).noise, [&](auto noisy) {
    for (Detection& detection : noisy) detection.sigma_px = 0.4;
    return positioner.locate(with_noise(noisy, random));
  });
}

TEST(ErrorBudget, TotalIsTheSum) {
  const Lens lens(LensModel::pinhole, std::array{520.0, 520.0, 400.0, 300.0});
  const auto budget =
      error_budget(positions_of(synthetic_lamps()), lens, {{0, 0, 0}, 0}, {0.1, 0.2, 0.003, 0.004});
  EXPECT_THAT(budget->total(),
              IsNear(Matrix4(budget->noise + budget->center + budget->tilt + budget->lamp_map), 0));
  EXPECT_GT(budget->lamp_map(0, 0), 0);
}

TEST(ErrorBudget, NeedsTwoLampsInFrontOfTheLens) {
  const Lens lens(LensModel::pinhole, std::array{520.0, 520.0, 400.0, 300.0});
  const ErrorSources noise{0.1, 0, 0, 0};
  const std::vector<Eigen::Vector3d> lamps_m{{0, 0, 2}, {1, 0, 2}};
  EXPECT_FALSE(error_budget({lamps_m.data(), 1}, lens, {{0, 0, 0}, 0}, noise));
  EXPECT_FALSE(error_budget(lamps_m, lens, {{0, 0, 2.5}, 0}, noise));
  EXPECT_TRUE(error_budget(lamps_m, lens, {{0, 0, 0}, 0}, noise));
}

}  // namespace
}  // namespace vlp
