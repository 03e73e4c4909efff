// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Covariances of rotation centers from derivatives of the projected lamps, limits of the axis fit,
/// and conversions of rotation centers.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "calibration/rotation/rotation_fit.h"
#include "calibration/rotation/spot.h"
#include "camera/lens.h"
#include "geometry/frames.h"
#include "support/matchers.h"

namespace vlp {
namespace {

Camera make_camera_with_unequal_focal_lengths() {
  Camera camera = synthetic_camera();
  camera.intrinsics[0] = 540;
  camera.intrinsics[1] = 500;
  return camera;
}

/// Returns a scene of few captures under four lamps.
RotationScene make_small_scene(const Eigen::Vector2d& lever_arm_m,
                               const std::vector<double>& heights_m, double step_m = 0) {
  RotationScene scene = tilted_scene(lever_arm_m, heights_m);
  scene.camera = make_camera_with_unequal_focal_lengths();
  scene.map = make_lamp_map(
      {{-0.5, -0.35, 1.6 + step_m}, {0.5, 0.2, 1.6}, {-0.4, 0.3, 1.6 + step_m}, {0.1, -0.4, 1.6}});
  scene.captures = 5;
  scene.arc_rad = 5;
  scene.only_in_image = false;
  return scene;
}

RotationCaptures find_rotation(const RotationScene& scene, const std::vector<Frame>& frames) {
  RotationCaptures rotation = find_in_place_rotation_captures(frames, scene.map, scene.camera);
  EXPECT_EQ(rotation.status, RotationStatus::ok) << describe_rotation_status(rotation.status);
  return rotation;
}

/// Gives the detections unequal sigma_px if `unequal`.
std::vector<Frame> make_noisy_frames(const RotationScene& scene, double sigma_px, bool unequal,
                                     Random& random) {
  std::vector<Frame> frames = scene.frames(sigma_px);
  for (Frame& frame : frames) {
    for (std::size_t i = 0; i < frame.detections.size() && unequal; ++i) {
      frame.detections[i].sigma_px = sigma_px * (1 + static_cast<double>(i));
    }
  }
  return with_noise(frames, random);
}

/// Pixels of all observations, divided by sigma_px, as a function of the unknowns.
using Observe = std::function<Eigen::VectorXd(const Eigen::VectorXd&)>;

/// Returns (J'J)^-1 with J from central difference quotients.
Eigen::MatrixXd invert_normal_equations(const Observe& observe, const Eigen::VectorXd& at) {
  constexpr double step = 1e-5;
  Eigen::MatrixXd jacobian(observe(at).size(), at.size());
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    const Eigen::VectorXd change = step * Eigen::VectorXd::Unit(at.size(), i);
    jacobian.col(i) = (observe(at + change) - observe(at - change)) / (2 * step);
  }
  return (jacobian.transpose() * jacobian).inverse();
}

/// Returns (J'J)^-1 of the axis fit at the true values. Unknowns: zenith, lever arm (if
/// `lever_arm`), lamps, axes of the heights but the first one, yaws but the first one, and the
/// height of the first axis, which moves so that the lamps keep their scale.
Eigen::MatrixXd compute_axis_fit_inverse(const RotationScene& scene,
                                         const RotationCaptures& rotation, bool lever_arm) {
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  const auto num_lamps = std::ssize(scene.map.lamps), num_heights = std::ssize(rotation.heights);
  const Eigen::Index lamps = lever_arm ? 4 : 2, axes = lamps + 2 * num_lamps,
                     yaws = axes + 3 * (num_heights - 1);
  const Eigen::Index first_z = yaws + std::ssize(rotation.captures) - 1;
  Eigen::VectorXd truth(first_z + 1);
  truth[first_z] = scene.heights_m[0];
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (const Lamp& lamp : scene.map.lamps) mean_m += lamp.position_m.head<2>() / num_lamps;
  truth.head<2>() = scene.truth().zenith_in_camera.hnormalized();
  if (lever_arm) truth.segment<2>(2) = scene.lever_arm_m;
  for (Eigen::Index i = 0; i < num_lamps; ++i) {
    truth.segment<2>(lamps + 2 * i) =
        scene.map.lamps[static_cast<std::size_t>(i)].position_m.head<2>();
  }
  for (Eigen::Index i = 1; i < num_heights; ++i) {
    truth.segment<3>(axes + 3 * (i - 1)) << scene.axis_m,
        scene.heights_m[static_cast<std::size_t>(i)];
  }
  for (Eigen::Index i = yaws; i < first_z; ++i) {
    truth[i] = rotation.captures[static_cast<std::size_t>(i - yaws + 1)].yaw_rad;
  }
  const Observe observe = [&](const Eigen::VectorXd& x) {
    const Eigen::Matrix3d camera_from_level =
        level_rotation_from_zenith({x[0], x[1], 1}).transpose();
    Eigen::VectorXd pixels = Eigen::VectorXd::Zero(2 * std::ssize(rotation.observations) + 1);
    for (Eigen::Index i = 0; i < num_lamps; ++i) {
      constexpr double scale_information = 1e6;
      const Eigen::Vector2d map_m =
          scene.map.lamps[static_cast<std::size_t>(i)].position_m.head<2>();
      pixels[pixels.size() - 1] +=
          scale_information * (map_m - mean_m).dot(x.segment<2>(lamps + 2 * i));
    }
    for (Eigen::Index k = 0; const RotationObservation& observation : rotation.observations) {
      const auto capture = static_cast<Eigen::Index>(observation.capture),
                 lamp = static_cast<Eigen::Index>(observation.lamp);
      const auto height = static_cast<Eigen::Index>(rotation.captures[observation.capture].height);
      Eigen::Vector3d axis_m(scene.axis_m.x(), scene.axis_m.y(), x[first_z]);
      if (height > 0) axis_m = x.segment<3>(axes + 3 * (height - 1));
      const double yaw_rad = capture > 0 ? x[yaws + capture - 1] : rotation.captures[0].yaw_rad;
      Eigen::Vector3d lamp_m;
      lamp_m << x.segment<2>(lamps + 2 * lamp), rotation.lamps[observation.lamp].position_m.z();
      Eigen::Vector3d x_in_level =
          Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ()) * (lamp_m - axis_m);
      if (lever_arm) x_in_level.head<2>() -= x.segment<2>(2);
      const auto pixel = lens.project_point(camera_from_level * x_in_level);
      pixels.segment<2>(k) = pixel.value_or(Eigen::Vector2d(NAN, NAN)) / *observation.sigma_px;
      k += 2;
    }
    return pixels;
  };
  return invert_normal_equations(observe, truth);
}

TEST(FitRotationAxis, CovarianceMatchesDerivativesOfPixelsAtOneHeight) {
  Random random(21);
  for (const bool unequal : {false, true}) {
    const RotationScene scene = make_small_scene({0, 0}, {0});
    const RotationCaptures rotation =
        find_rotation(scene, make_noisy_frames(scene, 0.02, unequal, random));
    ASSERT_EQ(rotation.status, RotationStatus::ok);
    const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
    ASSERT_TRUE(fit.converged && fit.covariance);
    ASSERT_TRUE(fit.outliers.empty());
    EXPECT_FALSE(fit.center.lever_arm_m);
    ASSERT_EQ(fit.covariance->rows(), 2);
    const Eigen::Matrix2d inverse =
        compute_axis_fit_inverse(scene, rotation, false).topLeftCorner<2, 2>();
    const Eigen::Matrix2d found = *fit.covariance;
    if (unequal) {
      EXPECT_NEAR(found.trace() / inverse.trace(), 1, 0.5) << "variance of unit noise";
      expect_relatively_near(found / found.trace(), inverse / inverse.trace(), 0.01);
    } else {
      expect_relatively_near(found, std::max(1.0, std::pow(fit.residual_px / 0.02, 2)) * inverse,
                             0.01);
    }
  }
}

TEST(FitRotationAxis, CovariancesMatchDerivativesOfPixelsAtTwoHeights) {
  Random random(22);
  RotationScene scene = make_small_scene({0.15, -0.3}, {0, 0.4});
  scene.camera = fisheye_camera();
  scene.tilt_rad = 0.2;
  scene.arc_rad = 3;  // unlike a full turn, it distinguishes the axes
  const RotationCaptures rotation =
      find_rotation(scene, make_noisy_frames(scene, 0.02, false, random));
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
  ASSERT_TRUE(fit.converged && fit.covariance && fit.center.lever_arm_m);
  ASSERT_EQ(fit.covariance->rows(), 4);
  ASSERT_TRUE(fit.outliers.empty());
  const Eigen::MatrixXd inverse = compute_axis_fit_inverse(scene, rotation, true);
  const double variance = std::max(1.0, std::pow(fit.residual_px / 0.02, 2));
  for (const Eigen::Index row : {0, 2}) {
    expect_relatively_near(fit.covariance->block<2, 2>(row, row),
                           variance * inverse.block<2, 2>(row, row), 0.01);
  }
  expect_relatively_near(fit.covariance->block<2, 2>(2, 0), variance * inverse.block<2, 2>(2, 0),
                         0.01);
}

/// A displaced detection with a sigma_px of its own is an outlier. The residual is that of the
/// other detections.
TEST(FitRotationAxis, OutlierDistanceAndResidualAreInPixels) {
  RotationScene scene = make_small_scene({0, 0}, {0});
  scene.captures = 12;
  scene.tilt_rad = 0;
  auto frames = scene.frames(0.5);
  for (Frame& frame : frames) {
    for (std::size_t i = 0; i < 2; ++i) frame.detections[i].sigma_px = 0.25;
  }
  frames[7].detections[1].pixel += Eigen::Vector2d(3, -4);
  const RotationCaptures rotation = find_rotation(scene, frames);
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  ASSERT_EQ(rotation.observations.size(), 48U);
  EXPECT_EQ(rotation.median_sigma_px, 0.5);
  const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
  ASSERT_TRUE(fit.converged);
  ASSERT_EQ(fit.outliers.size(), 1U);
  EXPECT_EQ(fit.outliers[0].observation, 29U);
  EXPECT_NEAR(fit.outliers[0].distance_px, 5, 0.15);
  ASSERT_EQ(fit.used_observations.size(), 47U);
  EXPECT_EQ(fit.used_observations[28], 28U);
  EXPECT_EQ(fit.used_observations[29], 30U);
  EXPECT_LT(fit.residual_px, 1e-6);
}

/// Returns captures with the given sigma_px, and with errors of up to `size_px` on each axis, in a
/// pattern that is the same for all sizes.
RotationCaptures find_captures_with_error(const RotationScene& scene, double size_px,
                                          double sigma_px) {
  std::vector<Frame> frames = scene.frames(sigma_px);
  Random random(25);
  for (Frame& frame : frames) {
    for (Detection& detection : frame.detections) {
      const double u = random.uniform(-1, 1), v = random.uniform(-1, 1);
      detection.pixel += size_px * Eigen::Vector2d(u, v);
    }
  }
  return find_rotation(scene, frames);
}

/// The limit is 0.007 focal lengths or four times the stated noise.
TEST(FitRotationAxis, FailsIfResidualExceedsLimit) {
  const RotationScene scene = make_small_scene({0, 0}, {0});
  const double residual_per_px = [&] {
    const auto rotation = find_captures_with_error(scene, 1, 2);
    return fit_rotation_axis(rotation, scene.camera).residual_px;
  }();
  ASSERT_GT(residual_per_px, 0.2);
  for (const double sigma_px : {0.9, 1.5}) {
    const double limit_px = sigma_px < 1 ? 0.007 * 540 : 4 * 1.5;
    for (const double factor : {0.96, 1.04}) {
      const auto rotation =
          find_captures_with_error(scene, factor * limit_px / residual_per_px, sigma_px);
      ASSERT_EQ(rotation.status, RotationStatus::ok);
      const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
      EXPECT_EQ(fit.converged, factor < 1) << sigma_px << " px, factor " << factor;
      if (fit.converged) {
        EXPECT_NEAR(fit.residual_px, factor * limit_px, 0.02 * limit_px);
        EXPECT_TRUE(fit.outliers.empty());
      }
    }
  }
}

/// The limit is 1 % of the distance between camera and highest lamp.
TEST(FitRotationAxis, EstimatesLeverArmForLampHeightsThatDifferByOnePercent) {
  for (const double fraction : {0.0095, 0.0105}) {
    const double step_m = 2 * fraction / (1 - fraction);  // other lamps: 1.6 + 0.4 m
    RotationScene scene = make_small_scene({0.01, -0.02}, {-0.4}, step_m);
    const RotationFit fit =
        fit_rotation_axis(find_rotation(scene, scene.frames(kMinSigma_px)), scene.camera);
    ASSERT_TRUE(fit.converged);
    EXPECT_EQ(fit.center.lever_arm_m.has_value(), fraction > 0.01);
    if (fit.center.lever_arm_m) {
      EXPECT_THAT(*fit.center.lever_arm_m, IsNear(scene.lever_arm_m, 1e-6));
    }
  }
}

/// The limit of its standard deviation is 0.5 % of the height of the first lamp above the camera.
TEST(FitRotationAxis, OmitsLeverArmWithTooLargeStandardDeviation) {
  const RotationScene scene = make_small_scene({0.01, -0.02}, {-0.4}, 0.2);
  const auto fit_with = [&](double size_px) {
    return fit_rotation_axis(find_captures_with_error(scene, size_px, kMinSigma_px), scene.camera);
  };
  constexpr double small_px = 0.01;
  const RotationFit small = fit_with(small_px);
  ASSERT_TRUE(small.converged && small.center.lever_arm_m);
  const double sd_m = std::sqrt(small.covariance->diagonal().tail<2>().maxCoeff());
  const double limit_px = small_px * 0.005 * 2.2 / sd_m;  // at the height 1.6 + 0.2 + 0.4 m
  for (const double factor : {0.9, 1.1}) {
    const RotationFit fit = fit_with(factor * limit_px);
    ASSERT_TRUE(fit.converged);
    EXPECT_EQ(fit.center.lever_arm_m.has_value(), factor < 1) << limit_px << " px";
    EXPECT_TRUE(fit.covariance);
  }
}

TEST(ComputeTiltFromRotationCenter, ReturnsAngleAndAzimuthOfZenith) {
  RotationCenter center{};
  center.zenith_in_camera = Eigen::Vector3d(0.03, 0.04, 0.05).normalized();
  EXPECT_NEAR(compute_tilt_from_rotation_center(center).angle_rad, M_PI / 4, 1e-12);
  EXPECT_NEAR(compute_tilt_from_rotation_center(center).azimuth_rad, std::atan(4. / 3), 1e-12);
  center.zenith_in_camera = Eigen::Vector3d(-0.2, 0, 0.98).normalized();
  EXPECT_NEAR(compute_tilt_from_rotation_center(center).azimuth_rad, M_PI, 1e-12);
  EXPECT_NEAR(compute_tilt_from_rotation_center(center).angle_rad, std::atan(0.2 / 0.98), 1e-12);
}

TEST(MakeRotationCenterFromAxisPoint, ScalesPointByFocalLengths) {
  const Camera camera = make_camera_with_unequal_focal_lengths();
  const RotationCenter center =
      make_rotation_center_from_axis_point({0.3, -0.4}, RotationModel::shift, camera);
  EXPECT_EQ(center.model, RotationModel::shift);
  EXPECT_THAT(center.center_px, IsNear(Eigen::Vector2d(403 + 162, 296 - 200), 1e-9));
  EXPECT_THAT(center.zenith_in_camera,
              IsNear(Eigen::Vector3d(0.3, -0.4, 1) / std::sqrt(1.25), 1e-12));
  EXPECT_FALSE(center.lever_arm_m);
  EXPECT_THAT(undistorted_pixel_from_normalized_point(camera, {-0.1, 0.2}),
              IsNear(Eigen::Vector2d(403 - 54, 296 + 100), 1e-9));
}

}  // namespace
}  // namespace vlp
