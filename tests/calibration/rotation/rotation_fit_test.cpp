// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_fit.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "calibration/rotation/spot.h"
#include "geometry/angles.h"
#include "rig/calibration_error.h"
#include "support/least_squares_oracle.h"
#include "support/matchers.h"

namespace vlp {
namespace {

constexpr double kExact_rad = rad_from_deg(1e-6);

void expect_exact(const RotationScene& scene) {
  const RotationFit found = fit_axis(scene, scene.frames());
  ASSERT_TRUE(found.converged);
  EXPECT_LT(angle_between(found.center.zenith_in_camera, scene.truth().zenith_in_camera),
            kExact_rad);
  EXPECT_THAT(found.center.center_px, IsNear(scene.truth().center_px, 1e-5));
  EXPECT_LT(found.residual_px, 1e-7);
  EXPECT_TRUE(found.outliers.empty());
  ASSERT_TRUE(found.center.lever_arm_m.has_value() || scene.heights_m.size() == 1);
  if (found.center.lever_arm_m) {
    EXPECT_THAT(*found.center.lever_arm_m, IsNear(scene.lever_arm_m, 1e-7));
  }
}

TEST(FitRotationAxis, FailsForCapturesAboutTwoAxes) {
  RotationScene scene, elsewhere;
  elsewhere.axis_m.x() += 0.07;
  auto frames = scene.frames(0.1);
  const auto others = elsewhere.frames(0.1);
  for (std::size_t i = 0; i < frames.size(); i += 2) frames[i].detections = others[i].detections;
  const RotationCaptures rotation = detect_pivots(frames, scene.map, scene.camera);
  EXPECT_TRUE(rotation.status != RotationStatus::ok ||
              !fit_rotation_axis(rotation, scene.camera).converged);
}

TEST(FitRotationAxis, ReturnsExactAxisAndLeverArmAtTwoHeights) {
  for (const double tilt_deg : {0.0, 0.5, 2.0, 5.0, 10.0}) {
    for (const Eigen::Vector2d& lever_arm_m :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.002, -0.001), Eigen::Vector2d(0.012, -0.009),
          Eigen::Vector2d(-0.1, 0.05), Eigen::Vector2d(0.2, 0.3)}) {
      SCOPED_TRACE(testing::Message() << tilt_deg << " deg, " << lever_arm_m.transpose());
      RotationScene scene;
      scene.tilt_rad = rad_from_deg(tilt_deg);
      scene.lever_arm_m = lever_arm_m;
      scene.heights_m = {0, 0.3};
      expect_exact(scene);
    }
  }
}

/// Lamps anywhere in view, few captures, small arcs: the closed-form initial values suffice.
TEST(FitRotationAxis, ReturnsExactAxisForRandomScenes) {
  Random random(11);
  for (int i = 0; i < 150; ++i) {
    SCOPED_TRACE(i);
    RotationScene scene;
    scene.tilt_rad = rad_from_deg(random.uniform(0, 10));
    scene.azimuth_rad = random.uniform(-3, 3);
    scene.axis_m = {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)};
    if (i % 2 == 0) {
      scene.heights_m = {0, random.uniform(0.2, 0.6)};
      scene.lever_arm_m = {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
    }
    std::vector<Eigen::Vector3d> lamps_m;
    const std::size_t lamps = 2 + random.index(5);
    while (lamps_m.size() < lamps) {
      // Sequential statements, because the order of evaluation of arguments is unspecified.
      const double z_m = random.uniform(1.5, 1.7), y_m = random.uniform(-0.8, 0.8);
      const Eigen::Vector3d at_m(random.uniform(-0.8, 0.8), y_m, z_m);
      const bool apart = std::all_of(lamps_m.begin(), lamps_m.end(), [&](const auto& other) {
        return (other - at_m).norm() > 0.4;
      });
      if (apart) lamps_m.push_back(at_m);
    }
    scene.map = make_lamp_map(lamps_m);
    scene.only_in_image = false;
    scene.captures = 3 + static_cast<int>(random.index(20));
    scene.arc_rad = random.uniform(2.2, 6);
    expect_exact(scene);
  }
}

/// The joint covariance of a lens with independent intrinsics has the derivatives of the fit with
/// respect to them.
TEST(FitRotationAxis, PropagatesErrorsOfLensLikeFitsWithOtherLenses) {
  RotationScene scene;
  scene.tilt_rad = rad_from_deg(3);
  scene.lever_arm_m = {0.02, -0.03};
  scene.heights_m = {0, 0.3};
  const auto frames = scene.frames(0.1);
  const auto solve = [&](const Eigen::VectorXd& intrinsics) -> Eigen::VectorXd {
    Camera camera = scene.camera;
    camera.intrinsics.assign(intrinsics.begin(), intrinsics.end());
    const RotationCenter center =
        fit_rotation_axis(detect_pivots(frames, scene.map, camera), camera).center;
    Eigen::VectorXd solution(4);
    solution << compute_zenith_point(center), center.lever_arm_m.value();
    return solution;
  };
  const Eigen::VectorXd intrinsics = Eigen::Map<const Eigen::VectorXd>(
      scene.camera.intrinsics.data(), std::ssize(scene.camera.intrinsics));
  const Eigen::Index count = intrinsics.size();
  const Eigen::MatrixXd jacobian = differentiate_numerically(solve, intrinsics, 1e-3);
  const RotationFit fit =
      fit_rotation_axis(detect_pivots(frames, scene.map, scene.camera), scene.camera,
                        MatrixX(0.01 * MatrixX::Identity(count, count)));
  ASSERT_TRUE(fit.converged && fit.covariance && fit.joint_covariance);
  ASSERT_EQ(fit.joint_covariance->rows(), count + 4);
  expect_relatively_near(fit.joint_covariance->bottomLeftCorner(4, count), 0.01 * jacobian, 0.01);
  expect_relatively_near(fit.joint_covariance->bottomRightCorner(4, 4),
                         *fit.covariance + 0.01 * jacobian * jacobian.transpose(), 0.01);
}

}  // namespace
}  // namespace vlp
