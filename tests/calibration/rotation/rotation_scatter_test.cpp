// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the reported covariance of each method with the scatter of its results.
#include <gmock/gmock.h>

#include <cmath>
#include <iostream>
#include <string>

#include "calibration/rotation/circle_center.h"
#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot.h"
#include "support/estimate_scatter.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Method = RotationFit (*)(const RotationCaptures&, const Camera&);

RotationFit mean_circle(const RotationCaptures& rotation, const Camera& camera) {
  return fit_circle_centers(rotation, camera, fit_rotation_axis(rotation, camera)).mean;
}

RotationFit axis(const RotationCaptures& rotation, const Camera& camera) {
  return fit_rotation_axis(rotation, camera);
}

struct RotationCase {
  std::string name;
  RotationScene scene;
  double map_sd_m = 0;
  bool noise_is_stated = true;
  double noise_px = 0.3;
  Method method = axis;
};

class FitRotationAxisScatter : public testing::TestWithParam<RotationCase> {};

/// 200 draws determine a standard deviation to 5 %, and that of a lever arm to 6 %, because the
/// error of the scale of the map is common to both axes. Residuals are those of the pixels.
TEST_P(FitRotationAxisScatter, ErrorsMatchReportedCovarianceAndInliersAreKept) {
  constexpr int draws = 200;
  const auto& [name, scene, map_sd_m, noise_is_stated, noise_px, method] = GetParam();
  const auto frames = scene.frames(noise_px);
  const RotationFit truth = method(detect_pivots(frames, scene.map, scene.camera), scene.camera);
  ASSERT_TRUE(truth.converged);
  Random random(14);
  EstimateScatter scatter;
  double squares_px2 = 0;
  int with_outliers = 0;
  for (int i = 0; i < draws; ++i) {
    LampMap surveyed = scene.map;
    for (Lamp& lamp : surveyed.lamps) {
      if (map_sd_m > 0) lamp.sd_m = map_sd_m;
      for (double& coordinate : lamp.position_m) coordinate += map_sd_m * random.normal();
    }
    std::vector<Frame> noisy = with_noise(frames, random);
    for (Frame& frame : noisy) {
      for (Detection& detection : frame.detections) {
        if (!noise_is_stated) detection.sigma_px.reset();
      }
    }
    const RotationCaptures rotation = detect_pivots(noisy, surveyed, scene.camera);
    ASSERT_EQ(rotation.status, RotationStatus::ok);
    const RotationFit fit = method(rotation, scene.camera);
    ASSERT_TRUE(fit.converged && fit.covariance);
    ASSERT_EQ(fit.center.lever_arm_m.has_value(), truth.center.lever_arm_m.has_value());
    Eigen::VectorXd error(fit.center.lever_arm_m ? 4 : 2);
    error.head<2>() =
        fit.center.zenith_in_camera.hnormalized() - truth.center.zenith_in_camera.hnormalized();
    if (fit.center.lever_arm_m)
      error.tail<2>() = *fit.center.lever_arm_m - *truth.center.lever_arm_m;
    scatter.add(error, *fit.covariance);
    squares_px2 += fit.residual_px * fit.residual_px / draws;
    with_outliers += fit.outliers.empty() ? 0 : 1;
  }
  const Eigen::VectorXd ratios = scatter.sd_ratios();
  std::cout << name << ": e/sd " << ratios.transpose() << ", " << with_outliers << " of " << draws
            << " with outliers, beyond 95 %: " << 100 * scatter.fraction_beyond_95() << " %\n";
  EXPECT_THAT(ratios, IsNear(Eigen::VectorXd::Ones(ratios.size()), 0.16));
  EXPECT_LT(scatter.correlation_difference().cwiseAbs().maxCoeff(), 0.2);
  EXPECT_LE(with_outliers, draws / 50);
  if (noise_is_stated) EXPECT_NEAR(scatter.fraction_beyond_95(), 0.05, 0.04);
  if (map_sd_m == 0) EXPECT_NEAR(std::sqrt(squares_px2) / noise_px, 1, 0.05);
}

RotationScene make_scene(const Eigen::Vector2d& lever_arm_m, const std::vector<double>& heights_m,
                         int captures = 12, std::size_t lamps = 8) {
  RotationScene scene = tilted_scene(lever_arm_m, heights_m);
  scene.only_in_image = false;
  scene.captures = captures;
  scene.map.lamps.resize(lamps);
  return scene;
}

RotationScene with_arc(RotationScene scene, double arc_rad) {
  scene.arc_rad = arc_rad;
  return scene;
}

RotationScene with_lamp_heights(RotationScene scene, double step_m) {
  for (std::size_t i = 0; i < scene.map.lamps.size(); i += 2)
    scene.map.lamps[i].position_m.z() += step_m;
  return scene;
}

RotationScene with_two_lamps(RotationScene scene) {
  scene.map.lamps.resize(2);
  scene.map.lamps[1].position_m = {0.5, 0.4, 1.6};
  return scene;
}

/// Returns a level scene with a pinhole lens, whose undistorted image, in which circles are fitted,
/// is the image.
RotationScene level_scene(int captures) {
  RotationScene scene = make_scene({0.012, -0.009}, {0}, captures);
  scene.tilt_rad = 0;
  scene.camera.lens_model = LensModel::pinhole;
  scene.camera.intrinsics.resize(4);
  return scene;
}

const std::vector<double> kOneHeight{0}, kTwoHeights{0, 0.3};
const Eigen::Vector2d kNoArm_m(0, 0), kArm_m(0.25, -0.2);
INSTANTIATE_TEST_SUITE_P(
    Rotation, FitRotationAxisScatter,
    testing::Values(
        RotationCase{"NoLeverArm", make_scene(kNoArm_m, kOneHeight)},
        RotationCase{"ArcOfThreeRadians", with_arc(make_scene(kNoArm_m, kOneHeight), 3)},
        RotationCase{"TwoLamps", with_two_lamps(make_scene(kNoArm_m, kOneHeight))},
        RotationCase{"ThreeCapturesNoiseNotStated", make_scene(kNoArm_m, kOneHeight, 3, 5), 0,
                     false},
        RotationCase{"SixCapturesNoiseNotStated", make_scene(kNoArm_m, kOneHeight, 6, 5), 0, false},
        RotationCase{"TwoHeights", make_scene({0.012, -0.009}, kTwoHeights)},
        RotationCase{"LongArmMapErrors", make_scene(kArm_m, kTwoHeights), 2e-3, true, 0.03},
        RotationCase{"LampsAtTwoHeightsMapErrors",
                     with_lamp_heights(make_scene(kArm_m, kTwoHeights), 0.3), 2e-3, true, 0.03},
        RotationCase{"OneHeightMapErrors", with_lamp_heights(make_scene(kArm_m, kOneHeight), 0.5),
                     1e-3, true, 0.03},
        RotationCase{"FourLampsMapErrors", make_scene({0.192, -0.256}, kTwoHeights, 6, 4), 2e-3,
                     true, 0.05},
        RotationCase{"Circles", level_scene(12), 0, true, 0.3, mean_circle},
        RotationCase{"CirclesOfEightCapturesNoiseNotStated", level_scene(8), 0, false, 0.3,
                     mean_circle}),
    [](const auto& one) { return one.param.name; });

/// A detection with an error of 6 px, 20 standard deviations, is rejected, and only this one.
TEST(RotationFit, BothMethodsRejectOnlyOutlierAmongFewCaptures) {
  constexpr int runs = 25;
  for (const Method method : {&mean_circle, &axis}) {
    RotationScene scene = level_scene(method == &mean_circle ? 12 : 4);
    scene.map.lamps.resize(5);
    auto frames = scene.frames(0.3);
    // Away from the rotation center.
    Eigen::Vector2d& pixel = frames[1].detections[2].pixel;
    pixel += 6 * (pixel - scene.camera.principal_point_px()).normalized();
    Random random(12);
    int found = 0, others = 0;
    for (int i = 0; i < runs; ++i) {
      const RotationCaptures rotation =
          detect_pivots(with_noise(frames, random), scene.map, scene.camera);
      ASSERT_EQ(rotation.status, RotationStatus::ok);
      for (const RotationOutlier& outlier : method(rotation, scene.camera).outliers) {
        const RotationObservation& at = rotation.observations[outlier.observation];
        const bool is_wrong = rotation.captures[at.capture].image == frames[1].image &&
                              rotation.lamps[at.lamp].id == frames[1].detections[2].lamp;
        ++(is_wrong ? found : others);
      }
    }
    EXPECT_GE(found, runs - 1);
    EXPECT_LE(others, 1);
  }
}

}  // namespace
}  // namespace vlp
