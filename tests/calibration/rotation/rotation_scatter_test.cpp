// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the reported covariance of each method with the scatter of its results.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <string>

#include "calibration/rotation/circle_center.h"
#include "calibration/rotation/planar_scatter.h"
#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot.h"
#include "geometry/angles.h"
#include "support/joint_covariance.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr int kDraws = 300;
constexpr double kNoise_px = 0.3;

RotationFit mean_circle(const RotationCaptures& rotation, const Camera& camera) {
  return fit_and_average_lamp_circle_centers(rotation, camera, fit_rotation_axis(rotation, camera))
      .mean;
}

using Method = RotationFit (*)(const RotationCaptures&, const Camera&);

RotationFit draw_fit(const RotationScene& scene, const std::vector<Frame>& frames, Method method,
                     Random& random, bool noise_is_stated = true) {
  std::vector<Frame> noisy = with_noise(frames, random);
  for (Frame& frame : noisy) {
    for (Detection& detection : frame.detections) {
      if (!noise_is_stated) detection.sigma_px.reset();
    }
  }
  const RotationCaptures rotation = find_in_place_rotation_captures(noisy, scene.map, scene.camera);
  EXPECT_EQ(rotation.status, RotationStatus::ok);
  const RotationFit fit = method(rotation, scene.camera);
  EXPECT_TRUE(fit.converged && fit.covariance);
  return fit;
}

/// 300 draws determine standard deviations to 4 %, and the fraction of 5 % outside to 1.3 %.
void expect_consistent(const PlanarScatter& scatter) {
  EXPECT_THAT(scatter.relative_sd_error(), IsNear(Eigen::Vector2d::Zero(), 0.14));
  EXPECT_NEAR(scatter.fraction_beyond_95(), 0.05, 0.04);
}

void expect_consistent(const RotationScene& scene, Method method, bool unbiased) {
  Random random(7);
  const auto frames = scene.frames(kNoise_px);
  const RotationCaptures exact = find_in_place_rotation_captures(frames, scene.map, scene.camera);
  ASSERT_EQ(exact.status, RotationStatus::ok);
  PlanarScatter scatter(method(exact, scene.camera).center.center_px);
  for (int i = 0; i < kDraws; ++i) {
    const RotationFit fit = draw_fit(scene, frames, method, random);
    ASSERT_TRUE(fit.covariance);
    scatter.add(fit.center.center_px, center_covariance_px2(*fit.covariance, scene.camera));
  }
  expect_consistent(scatter);
  if (unbiased) {
    EXPECT_THAT(scatter.bias(), IsNear(Eigen::Vector2d::Zero(), 3.5));
  }
}

RotationScene level_scene() {
  RotationScene scene;
  scene.lever_arm_m = {0.012, -0.009};
  return scene;
}

/// Pinhole lens, for which the undistorted image used by `circle` is the image. 300 draws of 24
/// degrees of freedom or more determine a standard deviation to 1 %.
TEST(RotationFit, ResidualOfEachMethodMatchesPixelNoisePerAxis) {
  RotationScene scene;  // no lever arm, which `axis` at one height cannot separate from a tilt
  scene.camera.lens_model = LensModel::pinhole;
  scene.camera.intrinsics.resize(4);
  scene.captures = 5;           // few, so that degrees of freedom count
  scene.only_in_image = false;  // or some circle has three points
  scene.arc_rad = 5;
  for (const Method method : {&mean_circle, &fit_rotation_axis}) {
    Random random(9);
    const auto frames = scene.frames(kNoise_px);
    double squares = 0;
    for (int i = 0; i < kDraws; ++i) {
      const RotationFit fit = draw_fit(scene, frames, method, random);
      squares += fit.residual_px * fit.residual_px / kDraws;
    }
    EXPECT_NEAR(std::sqrt(squares) / kNoise_px, 1, 0.05);
  }
}

/// Rotations at two heights, or at one under lamps at several, with a map that has errors of its
/// sd_m.
struct TurnUnderMap {
  const char* name;
  double map_sd_m;
  Eigen::Vector2d lever_arm_m;
  std::vector<double> heights_m;
  /// Height of every second lamp above the remaining lamps.
  double step_m;
  /// Number of captures at each height.
  int captures = 12;
  std::size_t lamps = 8;
  /// Stated noise of the detections.
  double noise_px = 0.03;
};

class FitRotationAxisWithMapErrors : public testing::TestWithParam<TurnUnderMap> {};

/// 300 maps of two axes determine a standard deviation to 3 %, that of the lever arm to 5 %,
/// because the error of the scale is common to both axes.
TEST_P(FitRotationAxisWithMapErrors, ZenithAndLeverArmErrorsMatchReportedCovariances) {
  constexpr int maps = 300;
  const TurnUnderMap& turn = GetParam();
  RotationScene scene = tilted_scene(turn.lever_arm_m, turn.heights_m);
  scene.only_in_image = false;
  scene.captures = turn.captures;
  scene.map.lamps.resize(turn.lamps);
  for (std::size_t i = 0; i < scene.map.lamps.size(); i += 2) {
    scene.map.lamps[i].position_m.z() += turn.step_m;
  }
  const auto frames = scene.frames(turn.noise_px);
  Random random(14);
  double zenith_squares = 0, arm_squares = 0, arm_variance_m2 = 0;
  for (int i = 0; i < maps; ++i) {
    LampMap surveyed = scene.map;
    for (Lamp& lamp : surveyed.lamps) {
      lamp.sd_m = turn.map_sd_m;
      for (double& coordinate : lamp.position_m) coordinate += turn.map_sd_m * random.normal();
    }
    const RotationCaptures rotation =
        find_in_place_rotation_captures(with_noise(frames, random), surveyed, scene.camera);
    ASSERT_EQ(rotation.status, RotationStatus::ok);
    const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
    ASSERT_TRUE(fit.converged && fit.covariance);
    ASSERT_TRUE(fit.center.lever_arm_m);
    for (int axis = 0; axis < 2; ++axis) {
      const double zenith_px = fit.center.center_px[axis] - scene.truth().center_px[axis];
      const double arm_m = (*fit.center.lever_arm_m)[axis] - scene.lever_arm_m[axis];
      zenith_squares += zenith_px * zenith_px /
                        center_covariance_px2(*fit.covariance, scene.camera)(axis, axis) /
                        (2 * maps);
      arm_squares += arm_m * arm_m / (*fit.covariance)(2 + axis, 2 + axis) / (2 * maps);
      arm_variance_m2 += (*fit.covariance)(2 + axis, 2 + axis) / (2 * maps);
    }
  }
  std::printf("%s: zenith e/sd %.2f, lever arm e/sd %.2f, sd %.3f mm\n", turn.name,
              std::sqrt(zenith_squares), std::sqrt(arm_squares), 1e3 * std::sqrt(arm_variance_m2));
  EXPECT_NEAR(std::sqrt(zenith_squares), 1, 0.1);
  EXPECT_NEAR(std::sqrt(arm_squares), 1, 0.15);
}

INSTANTIATE_TEST_SUITE_P(
    RotationScatter, FitRotationAxisWithMapErrors,
    testing::Values(TurnUnderMap{"ExactMap", 0, {0.25, -0.2}, {0, 0.3}, 0},
                    TurnUnderMap{"LongArm", 2e-3, {0.25, -0.2}, {0, 0.3}, 0},
                    TurnUnderMap{"ShortArm", 2e-3, {0.016, -0.012}, {0, 0.3}, 0},
                    TurnUnderMap{"LampsAtTwoHeights", 2e-3, {0.25, -0.2}, {0, 0.3}, 0.3},
                    TurnUnderMap{"OneHeight", 1e-3, {0.25, -0.2}, {0}, 0.5},
                    TurnUnderMap{"FourLampsArm50mm", 2e-3, {0.03, -0.04}, {0, 0.3}, 0, 6, 4, 0.05},
                    TurnUnderMap{"FourLampsArm200mm", 2e-3, {0.12, -0.16}, {0, 0.3}, 0, 6, 4, 0.05},
                    TurnUnderMap{
                        "FourLampsArm320mm", 2e-3, {0.192, -0.256}, {0, 0.3}, 0, 6, 4, 0.05},
                    TurnUnderMap{"FourLampsArm500mm", 2e-3, {0.3, -0.4}, {0, 0.3}, 0, 6, 4, 0.05}),
    [](const auto& turn) { return turn.param.name; });

struct SmallTurn {
  int captures, lamps;
};

/// Few captures without given noise: the median of few residuals scatters. 400 runs determine the
/// mean of e' C^-1 e to 5 %. With nu degrees of freedom C scatters, and the mean is 2 nu / (nu -
/// 2).
class FitRotationAxisWithFewCaptures : public testing::TestWithParam<SmallTurn> {};

TEST_P(FitRotationAxisWithFewCaptures, CenterErrorsMatchCovarianceAndInliersAreKept) {
  constexpr int runs = 400;
  RotationScene scene = tilted_scene({0, 0});
  scene.map.lamps.resize(static_cast<std::size_t>(GetParam().lamps));
  scene.captures = GetParam().captures;
  scene.only_in_image = false;
  const auto frames = scene.frames(kNoise_px);
  const RotationCaptures exact = find_in_place_rotation_captures(frames, scene.map, scene.camera);
  ASSERT_EQ(exact.status, RotationStatus::ok);
  const Eigen::Vector2d truth = fit_rotation_axis(exact, scene.camera).center.center_px;
  const double unknowns = 2 + 2 * GetParam().lamps + GetParam().captures - 1;
  const double freedom = 2 * GetParam().lamps * GetParam().captures - unknowns;
  Random random(12);
  double distance = 0;
  int with_outliers = 0;
  for (int i = 0; i < runs; ++i) {
    const RotationFit fit = draw_fit(scene, frames, fit_rotation_axis, random, false);
    ASSERT_TRUE(fit.covariance);
    const Eigen::Vector2d error = fit.center.center_px - truth;
    distance +=
        error.dot(center_covariance_px2(*fit.covariance, scene.camera).inverse() * error) / runs;
    with_outliers += fit.outliers.empty() ? 0 : 1;
  }
  std::printf("%d captures, %d lamps: %d of %d runs with outliers, e' C^-1 e %.2f, expected %.2f\n",
              GetParam().captures, GetParam().lamps, with_outliers, runs, distance,
              2 * freedom / (freedom - 2));
  EXPECT_LE(with_outliers, runs / 100);
  EXPECT_NEAR(distance / (2 * freedom / (freedom - 2)), 1, 0.25);
}

INSTANTIATE_TEST_SUITE_P(RotationScatter, FitRotationAxisWithFewCaptures,
                         testing::Values(SmallTurn{3, 5}, SmallTurn{4, 5}, SmallTurn{3, 8},
                                         SmallTurn{6, 5}),
                         [](const auto& turn) {
                           return std::to_string(turn.param.captures) + "CapturesOf" +
                                  std::to_string(turn.param.lamps) + "Lamps";
                         });

TEST(FitAndAverageLampCircleCenters, RejectsInliersInAtMostOnePercentOfRuns) {
  constexpr int runs = 200;
  for (const int captures : {8, 9, 12, 24}) {
    RotationScene scene = level_scene();
    scene.captures = captures;
    scene.only_in_image = false;
    const auto frames = scene.frames(kNoise_px);
    Random random(12);
    int with_outliers = 0;
    for (int i = 0; i < runs; ++i) {
      with_outliers += draw_fit(scene, frames, mean_circle, random, false).outliers.empty() ? 0 : 1;
    }
    std::printf("%d captures: %d of %d runs with outliers\n", captures, with_outliers, runs);
    EXPECT_LE(with_outliers, runs / 100) << captures;
  }
}

/// A detection with an error of 6 px, 20 standard deviations, is rejected, and only this one.
TEST(RotationFit, EachMethodRejectsOnlyTheOutlierAmongFewCaptures) {
  constexpr int runs = 50;
  struct Case {
    Method method;
    int captures;
  };
  for (const auto& [method, captures] : {Case{mean_circle, 12}, Case{fit_rotation_axis, 4}}) {
    RotationScene scene = method == &fit_rotation_axis ? tilted_scene({0, 0}) : level_scene();
    scene.map.lamps.resize(5);
    scene.captures = captures;
    scene.only_in_image = false;
    auto frames = scene.frames(kNoise_px);
    // Away from the rotation center.
    Eigen::Vector2d& pixel = frames[1].detections[2].pixel;
    pixel += 6 * (pixel - scene.camera.principal_point_px()).normalized();
    Random random(12);
    int found = 0, others = 0;
    for (int i = 0; i < runs; ++i) {
      const RotationCaptures rotation =
          find_in_place_rotation_captures(with_noise(frames, random), scene.map, scene.camera);
      ASSERT_EQ(rotation.status, RotationStatus::ok);
      const RotationFit fit = method(rotation, scene.camera);
      for (const RotationOutlier& outlier : fit.outliers) {
        const RotationObservation& at = rotation.observations[outlier.observation];
        const bool is_wrong = rotation.captures[at.capture].image == frames[1].image &&
                              rotation.lamps[at.lamp].id == frames[1].detections[2].lamp;
        ++(is_wrong ? found : others);
      }
    }
    std::printf("%d captures: found in %d of %d runs, %d others\n", captures, found, runs, others);
    EXPECT_GE(found, runs - 2);
    EXPECT_LE(others, 2);
  }
}

TEST(FitAndAverageLampCircleCenters, MeanCenterCovarianceMatchesScatterForLevelCamera) {
  expect_consistent(level_scene(), mean_circle, false);
}

TEST(FitRotationAxis, CenterCovarianceMatchesScatterWithoutLeverArm) {
  expect_consistent(tilted_scene({0, 0}), fit_rotation_axis, true);
}

TEST(FitRotationAxis, CenterCovarianceMatchesScatterForArcOfThreeRadians) {
  RotationScene scene = tilted_scene({0, 0});
  scene.arc_rad = 3;
  expect_consistent(scene, fit_rotation_axis, true);
}

TEST(FitRotationAxis, CenterCovarianceMatchesScatterForTwoLamps) {
  RotationScene scene = tilted_scene({0, 0});
  scene.map.lamps.resize(2);
  scene.map.lamps[1].position_m = {0.5, 0.4, 1.6};
  expect_consistent(scene, fit_rotation_axis, true);
}

TEST(FitRotationAxis, CenterAndLeverArmCovariancesMatchScatterForTwoHeights) {
  RotationScene scene = tilted_scene({0, 0});
  scene.heights_m = {0, 0.3};
  scene.lever_arm_m = {0.012, -0.009};
  Random random(8);
  const auto frames = scene.frames(kNoise_px);
  PlanarScatter center(scene.truth().center_px), lever_arm(scene.lever_arm_m);
  for (int i = 0; i < kDraws; ++i) {
    const RotationFit fit = draw_fit(scene, frames, fit_rotation_axis, random);
    ASSERT_TRUE(fit.covariance);
    ASSERT_TRUE(fit.center.lever_arm_m);
    center.add(fit.center.center_px, center_covariance_px2(*fit.covariance, scene.camera));
    lever_arm.add(*fit.center.lever_arm_m, Matrix2(fit.covariance->bottomRightCorner<2, 2>()));
  }
  expect_consistent(center);
  expect_consistent(lever_arm);
  EXPECT_THAT(center.bias(), IsNear(Eigen::Vector2d::Zero(), 3.5));
  EXPECT_THAT(lever_arm.bias(), IsNear(Eigen::Vector2d::Zero(), 3.5));
}

}  // namespace
}  // namespace vlp
