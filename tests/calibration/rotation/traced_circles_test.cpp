// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Circles through given points: inliers, determined centers, mean and covariance.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "calibration/rotation/circle_center.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

constexpr double kFocalX_px = 500, kFocalY_px = 400;

Camera make_traced_camera() {
  Camera camera;
  camera.imager_px = {800, 600};
  camera.lens_model = LensModel::pinhole;
  camera.intrinsics = {kFocalX_px, kFocalY_px, 403, 296};
  return camera;
}

/// Builds captures from normalized points of lamps. Each capture has one observation per lamp.
class TracedCaptures {
 public:
  explicit TracedCaptures(int lamps, int heights = 1) {
    for (int i = 0; i < lamps; ++i) {
      rotation.lamps.push_back({i + 1, {0.3 * i, 0.1, 2}, {}, {}, {}});
    }
    for (int i = 0; i < heights; ++i) rotation.heights.push_back({0.5 * i, {0, 0}, 6, 0});
  }

  /// Adds a capture and returns its index.
  std::size_t add_capture(double yaw_rad, std::size_t height = 0) {
    rotation.captures.push_back({std::to_string(rotation.captures.size()), height, yaw_rad});
    return rotation.captures.size() - 1;
  }
  void add_point(std::size_t capture, std::size_t lamp, const Eigen::Vector2d& point) {
    add_ray(capture, lamp, point.homogeneous().normalized());
  }
  void add_ray(std::size_t capture, std::size_t lamp, const Eigen::Vector3d& ray) {
    const Eigen::Vector2d pixel(403 + kFocalX_px * ray.x() / ray.z(),
                                296 + kFocalY_px * ray.y() / ray.z());
    rotation.observations.push_back({capture, lamp, pixel, {}, ray});
  }
  /// Adds points of a lamp at `angles`, one per capture from `first_capture` on. Adds
  /// `deviations` to the radius.
  void add_circle(std::size_t first_capture, std::size_t lamp, const Circle& circle,
                  const std::vector<double>& angles, const std::vector<double>& deviations = {}) {
    for (std::size_t i = 0; i < angles.size(); ++i) {
      const double radius = circle.radius + (i < deviations.size() ? deviations[i] : 0);
      add_point(first_capture + i, lamp,
                circle.center + radius * Eigen::Vector2d(std::cos(angles[i]), std::sin(angles[i])));
    }
  }

  RotationCaptures rotation;
};

std::vector<double> make_equal_angles(int count) {
  std::vector<double> angles;
  for (int i = 0; i < count; ++i) angles.push_back(0.1 + 2 * std::numbers::pi * i / count);
  return angles;
}

/// Returns the centers for an axis that fits all observations with this residual.
CircleCenters find_centers(const TracedCaptures& traced, double residual_px = 0) {
  RotationFit axis;
  axis.converged = true;
  axis.residual_px = residual_px;
  for (std::size_t i = 0; i < traced.rotation.observations.size(); ++i)
    axis.used_observations.push_back(i);
  return fit_circle_centers(traced.rotation, make_traced_camera(), axis);
}

/// Two circles with unequal numbers of points, and a lamp with two points only.
TEST(FitCircleCenters, ReturnsMeanSpreadResidualAndCovarianceOfCircles) {
  TracedCaptures traced(3);
  const auto angles = make_equal_angles(6);
  for (const double angle : angles) traced.add_capture(angle + 0.5);
  std::vector<std::vector<Eigen::Vector2d>> points(2);
  traced.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles, {1e-3, 0, -2e-3, 0, 1e-3, 5e-4});
  traced.add_circle(0, 1, {{0.03, 0.02}, 0.2}, {0.1, 0.9, 2.2, 3.8, 5.1}, {0, 1e-3, 0, 0, -1e-3});
  traced.add_circle(0, 2, {{0.5, 0.5}, 0.2}, {0.1, 0.9});
  traced.add_ray(2, 2, Eigen::Vector3d(0.1, 0.1, -1).normalized());  // behind the camera
  traced.add_ray(3, 2, Eigen::Vector3d(1, 0, 0));
  for (const RotationObservation& observation : traced.rotation.observations) {
    if (observation.lamp < 2) points[observation.lamp].emplace_back(observation.ray.hnormalized());
  }
  const auto first = fit_circle(points[0]), second = fit_circle(points[1]);
  ASSERT_TRUE(first && second);
  const CircleCenters found = find_centers(traced);
  ASSERT_TRUE(found.mean.converged);
  ASSERT_EQ(found.circles.size(), 2U);
  EXPECT_EQ(found.circles[0].lamp, 0U);
  EXPECT_EQ(found.circles[1].lamp, 1U);
  EXPECT_EQ(found.circles[1].height, 0U);
  EXPECT_EQ(found.undetermined, 0);
  const Eigen::Vector2d mean = 0.5 * (first->circle.center + second->circle.center);
  const Eigen::Vector2d focal_px(kFocalX_px, kFocalY_px);
  EXPECT_THAT(found.mean.center.center_px,
              IsNear(Eigen::Vector2d(403, 296) + focal_px.cwiseProduct(mean), 1e-9));
  EXPECT_THAT(found.mean.center.zenith_in_camera, IsNear(mean.homogeneous().normalized(), 1e-12));
  EXPECT_EQ(found.mean.center.model, RotationModel::shift);
  EXPECT_FALSE(found.mean.center.lever_arm_m);
  ASSERT_TRUE(found.mean.covariance);
  const Matrix2 covariance = (first->center_covariance + second->center_covariance) / 4;
  EXPECT_GT(covariance.cwiseAbs().minCoeff(), 1e-10);
  EXPECT_THAT(*found.mean.covariance, IsNear(MatrixX(covariance), 1e-15));
  EXPECT_NEAR(found.spread_px, kFocalX_px * (first->circle.center - mean).norm(), 1e-9);
  const double squares = 6 * std::pow(first->rms, 2) + 5 * std::pow(second->rms, 2);
  EXPECT_NEAR(found.mean.residual_px, kFocalX_px * std::sqrt(squares / (3 + 2)), 1e-9);
  EXPECT_EQ(found.mean.used_observations.size(), 11U);
}

/// Circles through three points have no residuals, and no covariance.
TEST(FitCircleCenters, ReturnsNoCovarianceForThreeCaptures) {
  TracedCaptures traced(2);
  const auto angles = make_equal_angles(3);
  for (const double angle : angles) traced.add_capture(angle);
  traced.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles);
  traced.add_circle(0, 1, {{0.02, -0.01}, 0.2}, {0.4, 0.4 + angles[1], 0.4 + angles[2]});
  const CircleCenters found = find_centers(traced);
  ASSERT_TRUE(found.mean.converged);
  EXPECT_EQ(found.circles.size(), 2U);
  EXPECT_FALSE(found.mean.covariance);
  EXPECT_EQ(found.mean.residual_px, 0);
  EXPECT_THAT(found.mean.center.center_px, IsNear(Eigen::Vector2d(413, 292), 1e-6));
}

/// Returns whether a circle of radius 0.3 through points at `angles` is used for given noise of
/// `sigma` and an axis with residuals of `axis_residual`.
bool is_determined(const std::vector<double>& angles, double sigma, double axis_residual = 0) {
  TracedCaptures traced(1);
  for (const double angle : angles) traced.add_capture(angle);
  traced.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles);
  traced.rotation.median_sigma_px = kFocalX_px * sigma;
  const CircleCenters found = find_centers(traced, kFocalX_px * axis_residual);
  EXPECT_EQ(found.undetermined, found.mean.converged ? 0 : 1);
  return found.mean.converged;
}

/// Four points at angles of +-a about two opposite directions. Across them, the information is
/// 4 sin^2 a and the contribution of the noise s^2 / R^2 4 cos^2 a.
TEST(FitCircleCenters, CenterIsUndeterminedIfNoiseExceedsQuarterOfInformation) {
  for (const double direction : {0.0, 0.8}) {
    for (const double a : {0.2, 0.5}) {
      std::vector<double> angles;
      for (const double angle : {a, -a, std::numbers::pi - a, std::numbers::pi + a}) {
        angles.push_back(direction + angle);
      }
      const double limit = 0.3 * std::sqrt(0.25) * std::tan(a);
      EXPECT_TRUE(is_determined(angles, 0.98 * limit)) << a;
      EXPECT_FALSE(is_determined(angles, 1.02 * limit)) << a;
      EXPECT_TRUE(is_determined(angles, 0, 0.98 * limit)) << a;
      EXPECT_FALSE(is_determined(angles, 0.98 * limit, 1.02 * limit)) << a;
    }
  }
}

/// Points on a straight line determine no circle.
TEST(FitCircleCenters, UsesHeightOnlyIfMostOfItsCirclesAreDetermined) {
  const auto angles = make_equal_angles(5);
  const auto make = [&](int circles, int lines) {
    TracedCaptures traced(circles + lines, 2);
    for (const double angle : angles) traced.add_capture(angle, 1);
    for (int lamp = 0; lamp < circles + lines; ++lamp) {
      for (std::size_t i = 0; i < angles.size(); ++i) {
        const double x = angles[i], radius = 0.1 + 0.05 * lamp;
        traced.add_point(i, static_cast<std::size_t>(lamp),
                         lamp < lines ? Eigen::Vector2d(0.01 * x, 0.02 * x)
                                      : Eigen::Vector2d(0.04 + radius * std::cos(x),
                                                        0.03 + radius * std::sin(x)));
      }
    }
    return traced;
  };
  const CircleCenters half = find_centers(make(1, 1));
  EXPECT_FALSE(half.mean.converged);
  EXPECT_EQ(half.undetermined, 1);
  EXPECT_TRUE(half.circles.empty());
  const CircleCenters most = find_centers(make(2, 1));
  ASSERT_TRUE(most.mean.converged);
  EXPECT_EQ(most.undetermined, 1);
  ASSERT_EQ(most.circles.size(), 2U);
  EXPECT_EQ(most.circles[0].lamp, 1U);
  EXPECT_EQ(most.circles[0].height, 1U);
  EXPECT_EQ(most.mean.used_observations.size(), 10U);
  EXPECT_THAT(most.mean.center.center_px, IsNear(Eigen::Vector2d(423, 308), 1e-6));
  const CircleCenters few = find_centers(make(1, 3));
  EXPECT_FALSE(few.mean.converged);
  EXPECT_EQ(few.undetermined, 3);
}

TEST(FitCircleCenters, UsesInliersOfConvergedAxisOnly) {
  const auto angles = make_equal_angles(6);
  TracedCaptures traced(1);
  for (const double angle : angles) traced.add_capture(angle);
  traced.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles, {0, 0, 0.1});
  RotationFit axis;
  axis.converged = true;
  axis.outliers = {{2, 50}};
  axis.used_observations = {0, 1, 3, 4, 5};
  const CircleCenters found = fit_circle_centers(traced.rotation, make_traced_camera(), axis);
  ASSERT_TRUE(found.mean.converged);
  EXPECT_EQ(found.mean.used_observations, axis.used_observations);
  ASSERT_EQ(found.mean.outliers.size(), 1U);
  EXPECT_THAT(found.mean.center.center_px, IsNear(Eigen::Vector2d(413, 292), 1e-6));
  axis.converged = false;
  EXPECT_FALSE(fit_circle_centers(traced.rotation, make_traced_camera(), axis).mean.converged);
}

}  // namespace
}  // namespace vlp
