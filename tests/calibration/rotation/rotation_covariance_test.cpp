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
/// `lever_arm`), lamps, axes of the heights but the first one, yaws but the first one.
Eigen::MatrixXd compute_axis_fit_inverse(const RotationScene& scene,
                                         const RotationCaptures& rotation, bool lever_arm) {
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  const auto num_lamps = std::ssize(scene.map.lamps), num_heights = std::ssize(rotation.heights);
  const Eigen::Index lamps = lever_arm ? 4 : 2, axes = lamps + 2 * num_lamps,
                     yaws = axes + 3 * (num_heights - 1);
  Eigen::VectorXd truth(yaws + std::ssize(rotation.captures) - 1);
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
  for (Eigen::Index i = yaws; i < truth.size(); ++i) {
    truth[i] = rotation.captures[static_cast<std::size_t>(i - yaws + 1)].yaw_rad;
  }
  const Observe observe = [&](const Eigen::VectorXd& x) {
    const Eigen::Matrix3d camera_from_level =
        level_rotation_from_zenith({x[0], x[1], 1}).transpose();
    Eigen::VectorXd pixels(2 * std::ssize(rotation.observations));
    for (Eigen::Index k = 0; const RotationObservation& observation : rotation.observations) {
      const auto capture = static_cast<Eigen::Index>(observation.capture),
                 lamp = static_cast<Eigen::Index>(observation.lamp);
      const auto height = static_cast<Eigen::Index>(rotation.captures[observation.capture].height);
      Eigen::Vector3d axis_m(scene.axis_m.x(), scene.axis_m.y(), scene.heights_m[0]);
      if (height > 0) axis_m = x.segment<3>(axes + 3 * (height - 1));
      const double yaw_rad = capture > 0 ? x[yaws + capture - 1] : rotation.captures[0].yaw_rad;
      Eigen::Vector3d lamp_m;
      lamp_m << x.segment<2>(lamps + 2 * lamp), rotation.lamps[observation.lamp].position_m.z();
      Eigen::Vector3d x_in_level =
          Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ()) * (lamp_m - axis_m);
      if (lever_arm) x_in_level.head<2>() -= x.segment<2>(2);
      const auto pixel = lens.project_point(camera_from_level * x_in_level);
      pixels.segment<2>(k) = pixel.value_or(Eigen::Vector2d(NAN, NAN)) / observation.sigma_px;
      k += 2;
    }
    return pixels;
  };
  return invert_normal_equations(observe, truth);
}

Eigen::Matrix2d covariance_of_normalized_point(const RotationFit& fit, const Camera& camera) {
  const Eigen::Vector2d inverse_px = camera.focal_px().cwiseInverse();
  return inverse_px.asDiagonal() * Eigen::Matrix2d(*fit.center.covariance) *
         inverse_px.asDiagonal();
}

TEST(FitRotationAxis, CovarianceMatchesDerivativesOfPixelsAtOneHeight) {
  Random random(21);
  for (const bool unequal : {false, true}) {
    const RotationScene scene = make_small_scene({0, 0}, {0});
    const RotationCaptures rotation =
        find_rotation(scene, make_noisy_frames(scene, 0.02, unequal, random));
    ASSERT_EQ(rotation.status, RotationStatus::ok);
    const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
    ASSERT_TRUE(fit.converged && fit.center.covariance);
    ASSERT_TRUE(fit.outliers.empty());
    EXPECT_FALSE(fit.center.lever_arm_m);
    EXPECT_FALSE(fit.center.lever_arm_covariance);
    EXPECT_FALSE(fit.center.lever_arm_jacobian_wrt_zenith);
    const Eigen::Matrix2d inverse =
        compute_axis_fit_inverse(scene, rotation, false).topLeftCorner<2, 2>();
    const Eigen::Matrix2d found = covariance_of_normalized_point(fit, scene.camera);
    if (unequal) {
      EXPECT_NEAR(found.trace() / inverse.trace(), 1, 0.5) << "variance of unit noise";
      expect_relatively_near(found / found.trace(), inverse / inverse.trace(), 0.01);
    } else {
      expect_relatively_near(found, std::pow(fit.residual_px / 0.02, 2) * inverse, 0.01);
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
  ASSERT_TRUE(fit.converged && fit.center.covariance && fit.center.lever_arm_covariance);
  ASSERT_TRUE(fit.center.lever_arm_jacobian_wrt_zenith);
  ASSERT_TRUE(fit.outliers.empty());
  const Eigen::MatrixXd inverse = compute_axis_fit_inverse(scene, rotation, true);
  const double variance = std::pow(fit.residual_px / 0.02, 2);
  expect_relatively_near(covariance_of_normalized_point(fit, scene.camera),
                         variance * inverse.topLeftCorner<2, 2>(), 0.01);
  expect_relatively_near(*fit.center.lever_arm_covariance, variance * inverse.block<2, 2>(2, 2),
                         0.01);
  expect_relatively_near(*fit.center.lever_arm_jacobian_wrt_zenith,
                         inverse.block<2, 2>(2, 0) * inverse.topLeftCorner<2, 2>().inverse(), 0.01);
}

/// Zenith (normalized point) and lever arm.
Eigen::Vector4d list_unknowns(const RotationFit& fit) {
  Eigen::Vector4d unknowns;
  unknowns << fit.center.zenith_in_camera.hnormalized(),
      fit.center.lever_arm_m.value_or(Eigen::Vector2d(NAN, NAN));
  return unknowns;
}

/// Effect of errors of the lamp map, from fits with changed lamps.
struct MapErrorEffect {
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  /// Sum of the squared residuals in px^2 that errors of one standard deviation cause.
  double squares_px2 = 0;
};

/// Height of each lamp, and its position on the ray from the mean of the lamps.
MapErrorEffect refit_with_map_errors(const RotationCaptures& rotation, const Camera& camera) {
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : rotation.lamps) {
    mean_m += lamp.position_m / static_cast<double>(rotation.lamps.size());
  }
  MapErrorEffect effect;
  for (std::size_t i = 0; i < rotation.lamps.size(); ++i) {
    Eigen::Vector3d outward = rotation.lamps[i].position_m - mean_m;
    outward.z() = 0;
    for (const Eigen::Vector3d& direction :
         {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(outward.normalized())}) {
      RotationCaptures plus = rotation, minus = rotation;
      const Eigen::Vector3d error_m = rotation.lamps[i].sd_m.value_or(0) * direction;
      plus.lamps[i].position_m += error_m;
      minus.lamps[i].position_m -= error_m;
      const RotationFit fit_plus = fit_rotation_axis(plus, camera),
                        fit_minus = fit_rotation_axis(minus, camera);
      EXPECT_TRUE(fit_plus.converged && fit_minus.converged);
      const Eigen::Vector4d change = (list_unknowns(fit_plus) - list_unknowns(fit_minus)) / 2;
      effect.covariance += change * change.transpose();
      const double unknowns = 4 + 2 * static_cast<double>(rotation.lamps.size()) +
                              3 * static_cast<double>(rotation.heights.size() - 1) +
                              static_cast<double>(rotation.captures.size() - 1);
      const double freedom = 2 * static_cast<double>(rotation.observations.size()) - unknowns;
      effect.squares_px2 +=
          freedom * (std::pow(fit_plus.residual_px, 2) + std::pow(fit_minus.residual_px, 2)) / 2;
    }
  }
  return effect;
}

/// Exact detections: the map is the only source of error.
TEST(FitRotationAxis, CovariancesMatchFitsWithChangedLampsForExactDetections) {
  for (const bool two_heights : {true, false}) {
    SCOPED_TRACE(two_heights);
    RotationScene scene = two_heights ? make_small_scene({0.05, -0.08}, {0, 0.4}, 0.1)
                                      : make_small_scene({0.05, -0.08}, {0}, 0.4);
    for (std::size_t i = 0; i < 3; ++i) {
      scene.map.lamps[i].sd_m = 1e-4 * (1 + static_cast<double>(i));
    }
    const RotationCaptures rotation = find_rotation(scene, scene.frames());
    ASSERT_EQ(rotation.status, RotationStatus::ok);
    const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
    ASSERT_TRUE(fit.converged && fit.center.covariance && fit.center.lever_arm_covariance);
    ASSERT_TRUE(fit.center.lever_arm_jacobian_wrt_zenith);
    const Eigen::Matrix4d expected = refit_with_map_errors(rotation, scene.camera).covariance;
    expect_relatively_near(covariance_of_normalized_point(fit, scene.camera),
                           expected.topLeftCorner<2, 2>(), 0.01);
    expect_relatively_near(*fit.center.lever_arm_covariance, expected.bottomRightCorner<2, 2>(),
                           0.01);
    expect_relatively_near(
        *fit.center.lever_arm_jacobian_wrt_zenith,
        expected.bottomLeftCorner<2, 2>() * expected.topLeftCorner<2, 2>().inverse(), 0.01);
  }
}

/// The part of the squared residuals that errors of the map explain does not count as noise.
TEST(FitRotationAxis, CovariancesCountResidualsDueToMapErrorsOnce) {
  RotationScene scene = make_small_scene({0.05, -0.08}, {0, 0.4}, 0.1);
  LampMap uncertain = scene.map;
  for (Lamp& lamp : uncertain.lamps) lamp.sd_m = 7e-4;
  Random random(23);
  const auto frames = make_noisy_frames(scene, 0.02, false, random);
  const RotationCaptures exact_map = find_rotation(scene, frames);
  ASSERT_EQ(exact_map.status, RotationStatus::ok);
  RotationCaptures rotation = exact_map;
  rotation.lamps = uncertain.lamps;
  RotationCaptures exact = find_rotation(scene, scene.frames());
  exact.lamps = uncertain.lamps;
  const MapErrorEffect effect = refit_with_map_errors(exact, scene.camera);
  const RotationFit without = fit_rotation_axis(exact_map, scene.camera);
  const RotationFit fit = fit_rotation_axis(rotation, scene.camera);
  ASSERT_TRUE(fit.converged && fit.center.lever_arm_covariance && fit.center.covariance);
  ASSERT_TRUE(without.converged && without.center.lever_arm_covariance);
  ASSERT_TRUE(without.center.covariance && fit.outliers.empty());
  ASSERT_EQ(rotation.observations.size(), 40U);
  // Unknowns: zenith and lever arm, lamps, axis of the second height, yaws.
  const double freedom = 2 * 40 - (4 + 8 + 3 + 9);
  const double fraction = 1 - effect.squares_px2 / (freedom * std::pow(fit.residual_px, 2));
  EXPECT_GT(fraction, 0.2);
  EXPECT_LT(fraction, 0.95);
  expect_relatively_near(covariance_of_normalized_point(fit, scene.camera),
                         fraction * covariance_of_normalized_point(without, scene.camera) +
                             effect.covariance.topLeftCorner<2, 2>(),
                         0.02);
  expect_relatively_near(*fit.center.lever_arm_covariance,
                         fraction * Eigen::Matrix2d(*without.center.lever_arm_covariance) +
                             effect.covariance.bottomRightCorner<2, 2>(),
                         0.02);
}

/// Level camera: observed points c + R(-yaw) q. Unknowns: c, q for each lamp and height, and yaws
/// but the first one at each height.
TEST(FitRotationCenterToAllLamps, CovarianceMatchesDerivativesOfPixels) {
  Random random(24);
  RotationScene scene = make_small_scene({0.05, -0.08}, {0, 0.4});
  scene.tilt_rad = 0;
  scene.lever_arm_m = {0, 0};
  const RotationCaptures rotation =
      find_rotation(scene, make_noisy_frames(scene, 0.02, false, random));
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  const RotationFit fit = fit_rotation_center_to_all_lamps(rotation, scene.camera);
  ASSERT_TRUE(fit.converged && fit.center.covariance);
  ASSERT_TRUE(fit.outliers.empty());
  EXPECT_FALSE(fit.center.lever_arm_m);
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  Eigen::VectorXd truth = Eigen::VectorXd::Zero(2 + 16 + 10);
  for (std::size_t height = 0; height < 2; ++height) {
    for (std::size_t lamp = 0; lamp < 4; ++lamp) {
      const Eigen::Vector3d& lamp_m = scene.map.lamps[lamp].position_m;
      truth.segment<2>(static_cast<Eigen::Index>(2 + 8 * height + 2 * lamp)) =
          (lamp_m.head<2>() - scene.axis_m) / (lamp_m.z() - scene.heights_m[height]);
    }
  }
  for (std::size_t i = 0; i < 10; ++i) {
    truth[static_cast<Eigen::Index>(18 + i)] = rotation.captures[i].yaw_rad;
  }
  const Observe observe = [&](const Eigen::VectorXd& free_unknowns) {
    Eigen::VectorXd x = truth;
    x.head<18>() = free_unknowns.head<18>();
    x.segment<4>(19) = free_unknowns.segment<4>(18);
    x.segment<4>(24) = free_unknowns.segment<4>(22);
    Eigen::VectorXd pixels(2 * std::ssize(rotation.observations));
    for (Eigen::Index k = 0; const RotationObservation& observation : rotation.observations) {
      const std::size_t height = rotation.captures[observation.capture].height;
      const Eigen::Vector2d point =
          x.head<2>() +
          Eigen::Rotation2Dd(-x[static_cast<Eigen::Index>(18 + observation.capture)]) *
              x.segment<2>(static_cast<Eigen::Index>(2 + 8 * height + 2 * observation.lamp));
      pixels.segment<2>(k) =
          lens.project_point(point.homogeneous()).value_or(Eigen::Vector2d(NAN, NAN)) / 0.02;
      k += 2;
    }
    return pixels;
  };
  Eigen::VectorXd at(26);
  at << truth.head<18>(), truth.segment<4>(19), truth.segment<4>(24);
  const Eigen::Matrix2d inverse = invert_normal_equations(observe, at).topLeftCorner<2, 2>();
  expect_relatively_near(covariance_of_normalized_point(fit, scene.camera),
                         std::pow(fit.residual_px / 0.02, 2) * inverse, 0.01);
}

/// A displaced detection with a sigma_px of its own is an outlier of either method. The residual
/// is that of the other detections.
TEST(RotationFit, OutlierDistanceAndResidualAreInPixels) {
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
  for (const auto method : {&fit_rotation_axis, &fit_rotation_center_to_all_lamps}) {
    const RotationFit fit = method(rotation, scene.camera);
    ASSERT_TRUE(fit.converged);
    ASSERT_EQ(fit.outliers.size(), 1U);
    EXPECT_EQ(fit.outliers[0].observation, 29U);
    EXPECT_NEAR(fit.outliers[0].distance_px, 5, 0.15);
    ASSERT_EQ(fit.used_observations.size(), 47U);
    EXPECT_EQ(fit.used_observations[28], 28U);
    EXPECT_EQ(fit.used_observations[29], 30U);
    EXPECT_LT(fit.residual_px, 1e-6);
    ASSERT_EQ(fit.yaws_rad.size(), 12U);
    EXPECT_NEAR(std::remainder(fit.yaws_rad[5] - fit.yaws_rad[3] -
                                   (rotation.captures[5].yaw_rad - rotation.captures[3].yaw_rad),
                               2 * M_PI),
                0, 1e-3);
  }
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
    const RotationFit fit = fit_rotation_axis(find_rotation(scene, scene.frames()), scene.camera);
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
    return fit_rotation_axis(find_captures_with_error(scene, size_px, 0.5), scene.camera);
  };
  constexpr double small_px = 0.01;
  const RotationFit small = fit_with(small_px);
  ASSERT_TRUE(small.converged && small.center.lever_arm_covariance);
  const double sd_m = std::sqrt(small.center.lever_arm_covariance->diagonal().maxCoeff());
  const double limit_px = small_px * 0.005 * 2.2 / sd_m;  // at the height 1.6 + 0.2 + 0.4 m
  for (const double factor : {0.9, 1.1}) {
    const RotationFit fit = fit_with(factor * limit_px);
    ASSERT_TRUE(fit.converged);
    EXPECT_EQ(fit.center.lever_arm_m.has_value(), factor < 1) << limit_px << " px";
    EXPECT_TRUE(fit.center.covariance);
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

TEST(ComputeRotationAxisSd, IsRmsOverBothImageAxes) {
  const Camera camera = make_camera_with_unequal_focal_lengths();
  RotationCenter center{};
  EXPECT_FALSE(compute_rotation_axis_sd_rad(center, camera));
  center.covariance = Matrix2{{std::pow(540 * 0.003, 2), 1}, {1, std::pow(500 * 0.004, 2)}};
  const auto sd_rad = compute_rotation_axis_sd_rad(center, camera);
  ASSERT_TRUE(sd_rad);
  EXPECT_NEAR(*sd_rad, std::sqrt((9e-6 + 16e-6) / 2), 1e-12);
}

TEST(MakeRotationCenterFromAxisPoint, ScalesPointAndCovarianceByFocalLengths) {
  const Camera camera = make_camera_with_unequal_focal_lengths();
  const Matrix2 covariance{{2e-6, 1e-6}, {1e-6, 3e-6}};
  const RotationCenter center =
      make_rotation_center_from_axis_point({0.3, -0.4}, RotationModel::shift, camera, covariance);
  EXPECT_EQ(center.model, RotationModel::shift);
  EXPECT_THAT(center.center_px, IsNear(Eigen::Vector2d(403 + 162, 296 - 200), 1e-9));
  EXPECT_THAT(center.zenith_in_camera,
              IsNear(Eigen::Vector3d(0.3, -0.4, 1) / std::sqrt(1.25), 1e-12));
  ASSERT_TRUE(center.covariance);
  EXPECT_THAT(*center.covariance, IsNear(Matrix2{{0.5832, 0.27}, {0.27, 0.75}}, 1e-12));
  const RotationCenter without =
      make_rotation_center_from_axis_point({0, 0}, RotationModel::tilt, camera, {});
  EXPECT_EQ(without.model, RotationModel::tilt);
  EXPECT_FALSE(without.covariance);
  EXPECT_THAT(undistorted_pixel_from_normalized_point(camera, {-0.1, 0.2}),
              IsNear(Eigen::Vector2d(403 - 54, 296 + 100), 1e-9));
}

}  // namespace
}  // namespace vlp
