// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Circles through given points: rejection of outliers, determined centers, mean and covariance.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <optional>
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

/// Returns alternating deviations +size, -size.
std::vector<double> make_alternating_deviations(int count, double size) {
  std::vector<double> deviations;
  for (int i = 0; i < count; ++i) deviations.push_back(i % 2 == 0 ? size : -size);
  return deviations;
}

CircleCenters find_centers(const TracedCaptures& traced) {
  return fit_and_average_lamp_circle_centers(traced.rotation, make_traced_camera());
}

std::vector<std::size_t> list_outliers(const CircleCenters& centers) {
  std::vector<std::size_t> observations;
  for (const RotationOutlier& outlier : centers.mean.outliers) {
    observations.push_back(outlier.observation);
  }
  return observations;
}

/// Twelve captures with one lamp and the given deviations from a circle of radius 0.3.
TracedCaptures make_single_trace(const std::vector<double>& deviations) {
  TracedCaptures traced(1);
  const auto angles = make_equal_angles(static_cast<int>(deviations.size()));
  for (const double angle : angles) traced.add_capture(angle);
  traced.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles, deviations);
  return traced;
}

/// Two circles with unequal numbers of points, and a lamp with two points only.
TEST(FitAndAverageLampCircleCenters, ReturnsMeanSpreadResidualAndCovarianceOfCircles) {
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
TEST(FitAndAverageLampCircleCenters, HasNoCovarianceForThreeCaptures) {
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

/// The worst of twelve points is compared with the circle of the other eleven points. The bound is
/// 4.5 standard deviations, by Student's t with eight degrees of freedom (Wallace's approximation).
TEST(FitAndAverageLampCircleCenters, RejectsPointBeyondStudentBoundOfOtherPoints) {
  struct DeletedResidual {
    double distance, bound;
  };
  const auto compute_deleted_residual = [](double deviation) -> DeletedResidual {
    std::vector<double> deviations = make_alternating_deviations(12, 1e-3);
    deviations[5] = deviation;
    const TracedCaptures traced = make_single_trace(deviations);
    std::vector<Eigen::Vector2d> others;
    for (std::size_t i = 0; i < 12; ++i) {
      if (i != 5) others.emplace_back(traced.rotation.observations[i].ray.hnormalized());
    }
    const auto fit = fit_circle(others);
    if (!fit) return {NAN, NAN};
    const Eigen::Vector2d point = traced.rotation.observations[5].ray.hnormalized();
    const double distance = std::abs((point - fit->circle.center).norm() - fit->circle.radius);
    const double variance = 11 * fit->rms * fit->rms / 8 * (1 + 3. / 11);
    const double z = 4.5 * (8 * 8 + 3) / (8 * 8 + 1);
    return {distance, std::sqrt(variance * 8 * (std::exp(z * z / 8) - 1))};
  };
  // The distance is nearly proportional to the deviation.
  const DeletedResidual start = compute_deleted_residual(0.02);
  const double limit = 0.02 * start.bound / start.distance;
  ASSERT_GT(limit, 5e-3);
  for (const double factor : {0.97, 1.03}) {
    std::vector<double> deviations = make_alternating_deviations(12, 1e-3);
    deviations[5] = factor * limit;
    const auto [distance, bound] = compute_deleted_residual(deviations[5]);
    ASSERT_EQ(distance > bound, factor > 1);
    const CircleCenters found = find_centers(make_single_trace(deviations));
    ASSERT_TRUE(found.mean.converged);
    if (factor < 1) {
      EXPECT_TRUE(found.mean.outliers.empty());
      EXPECT_EQ(found.mean.used_observations.size(), 12U);
      continue;
    }
    ASSERT_THAT(list_outliers(found), testing::ElementsAre(5));
    EXPECT_NEAR(found.mean.outliers[0].distance_px, kFocalX_px * distance, 1e-6);
    EXPECT_EQ(found.mean.used_observations.size(), 11U);
  }
}

/// Two gross errors hide each other from the test of single points. They are rejected beyond about
/// 100 times the median distance.
TEST(FitAndAverageLampCircleCenters, RejectsSeveralPointsFarFromMedianCircle) {
  for (const double size : {0.05, 0.25}) {
    std::vector<double> deviations = make_alternating_deviations(12, 1e-3);
    deviations[0] = deviations[6] = size;
    const CircleCenters found = find_centers(make_single_trace(deviations));
    ASSERT_TRUE(found.mean.converged);
    if (size < 0.1) {
      EXPECT_TRUE(found.mean.outliers.empty());
      continue;
    }
    ASSERT_THAT(list_outliers(found), testing::UnorderedElementsAre(0, 6));
    for (const RotationOutlier& outlier : found.mean.outliers) {
      EXPECT_NEAR(outlier.distance_px, kFocalX_px * size, 1);
    }
    const std::vector<std::size_t> expected = {1, 2, 3, 4, 5, 7, 8, 9, 10, 11};
    EXPECT_EQ(found.mean.used_observations, expected);
    EXPECT_NEAR(found.mean.residual_px, kFocalX_px * 1e-3 * std::sqrt(10. / 7), 0.05);
  }
}

/// Points on an exact circle scatter by rounding errors, below 1e-9.
TEST(FitAndAverageLampCircleCenters, ToleratesRoundingOfExactPointsAndRejectsLargerDeviations) {
  std::vector<double> deviations(12, 0);
  deviations[4] = 1e-9;
  EXPECT_TRUE(find_centers(make_single_trace(deviations)).mean.outliers.empty());
  deviations[4] = 1e-5;
  const CircleCenters found = find_centers(make_single_trace(deviations));
  ASSERT_THAT(list_outliers(found), testing::ElementsAre(4));
  EXPECT_NEAR(found.mean.outliers[0].distance_px, kFocalX_px * 1e-5, 1e-7);
}

TEST(FitAndAverageLampCircleCenters, RejectsOutliersOnlyForEightPointsOrMore) {
  for (const int count : {7, 8}) {
    std::vector<double> deviations(static_cast<std::size_t>(count), 0);
    deviations[3] = 0.02;
    const CircleCenters found = find_centers(make_single_trace(deviations));
    ASSERT_TRUE(found.mean.converged);
    EXPECT_EQ(found.mean.outliers.size(), count == 8 ? 1U : 0U) << count;
    EXPECT_EQ(found.mean.residual_px > 1, count == 7);
  }
}

/// The six other points are too few to reject a point by Student's t.
TEST(FitAndAverageLampCircleCenters, RejectsFirstAndLastOfEightPointsFarFromMedianCircle) {
  std::vector<double> deviations(8, 0);
  deviations[0] = 0.04;
  deviations[7] = -0.05;
  const CircleCenters found = find_centers(make_single_trace(deviations));
  ASSERT_TRUE(found.mean.converged);
  // The last point first.
  ASSERT_THAT(list_outliers(found), testing::ElementsAre(7, 0));
  EXPECT_NEAR(found.mean.outliers[0].distance_px, kFocalX_px * 0.05, 1e-6);
  EXPECT_NEAR(found.mean.outliers[1].distance_px, kFocalX_px * 0.04, 1e-6);
  EXPECT_EQ(found.mean.used_observations.size(), 6U);
}

/// Returns whether a circle of radius 0.3 through points at `angles` is used for noise of `sigma`.
bool is_determined(const std::vector<double>& angles, double sigma) {
  TracedCaptures traced(1);
  for (const double angle : angles) traced.add_capture(angle);
  traced.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles);
  traced.rotation.median_sigma_px = kFocalX_px * sigma;
  const CircleCenters found = find_centers(traced);
  EXPECT_EQ(found.undetermined, found.mean.converged ? 0 : 1);
  return found.mean.converged;
}

/// Four points at angles of +-a about two opposite directions. Across them, the information is
/// 4 sin^2 a and the contribution of the noise s^2 / R^2 4 cos^2 a.
TEST(FitAndAverageLampCircleCenters, CenterIsDeterminedUpToQuarterNoiseAcrossOppositeYaws) {
  for (const double direction : {0.0, 0.8}) {
    for (const double a : {0.2, 0.5}) {
      std::vector<double> angles;
      for (const double angle : {a, -a, std::numbers::pi - a, std::numbers::pi + a}) {
        angles.push_back(direction + angle);
      }
      const double limit = 0.3 * std::sqrt(0.25) * std::tan(a);
      EXPECT_TRUE(is_determined(angles, 0.98 * limit)) << a;
      EXPECT_FALSE(is_determined(angles, 1.02 * limit)) << a;
    }
  }
}

/// Points at 0, 0, and +-a: along their direction, the information about the mean is
/// (1 - cos a)^2, and the contribution of the noise s^2 / R^2 2 sin^2 a.
TEST(FitAndAverageLampCircleCenters, CenterIsDeterminedUpToQuarterNoiseAlongShortArc) {
  constexpr double a = 1;
  const double limit = 0.3 * std::sqrt(0.25 * std::pow(1 - std::cos(a), 2) / 2) / std::sin(a);
  EXPECT_TRUE(is_determined({0, a, 0, -a}, 0.98 * limit));
  EXPECT_FALSE(is_determined({0, a, 0, -a}, 1.02 * limit));
}

/// Without stated noise, the residuals of the circles count.
TEST(FitAndAverageLampCircleCenters, UsesResidualsAsNoiseWithoutStatedNoise) {
  constexpr double a = 0.2;
  std::vector<double> angles;
  for (int i = 0; i < 2; ++i) {
    for (const double angle : {a, -a, std::numbers::pi - a, std::numbers::pi + a}) {
      angles.push_back(angle);
    }
  }
  angles.resize(7);  // too few to reject outliers
  TracedCaptures traced(1);
  for (const double angle : angles) traced.add_capture(angle);
  const auto is_used = [&](double size, std::optional<double> sigma) {
    TracedCaptures noisy = traced;
    noisy.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles,
                     {size, size, -size, 0, -size, -size, size});
    if (sigma) noisy.rotation.median_sigma_px = kFocalX_px * *sigma;
    return find_centers(noisy).mean.converged;
  };
  EXPECT_TRUE(is_used(0.002, {}));
  EXPECT_FALSE(is_used(0.06, {}));
  EXPECT_FALSE(is_used(0.06, 1e-4)) << "residuals above the stated noise";
  EXPECT_FALSE(is_used(0.002, 0.06)) << "residuals below the stated noise";
}

/// Circles through three points have no residuals. The noise is then the residual of the axis,
/// about which the lamps disagree by angles of +-`size`. Along y, the information is 2 sin^2 a and
/// the contribution of the noise s^2 / R^2 (2 cos^2 a + 1).
TEST(FitAndAverageLampCircleCenters, UsesResidualOfAxisAsNoiseForThreeCaptures) {
  constexpr double a = 0.03, turn = std::numbers::pi;
  const double limit = 0.3 * 0.5 * std::sin(a) / std::sqrt(std::pow(std::cos(a), 2) + 0.5);
  for (const double size : {0.006, 0.033}) {
    TracedCaptures traced(2);
    traced.rotation.lamps[0].position_m = {0.6, 0, 2};
    traced.rotation.lamps[1].position_m = {0.56, 0, 2};
    for (const double angle : {a, -a, turn}) traced.add_capture(-angle);
    traced.add_circle(0, 0, {{0, 0}, 0.3}, {a + size, -a + size, turn - size});
    traced.add_circle(0, 1, {{0, 0}, 0.28}, {a - size, -a - size, turn + size});
    const RotationFit axis = fit_rotation_axis(traced.rotation, make_traced_camera());
    ASSERT_TRUE(axis.converged);
    const double noise = axis.residual_px / kFocalX_px;
    if (size < 0.01) {
      ASSERT_GT(noise, 0.1 * limit);
      ASSERT_LT(noise, 0.7 * limit);
    } else {
      ASSERT_GT(noise, 1.4 * limit);
    }
    EXPECT_EQ(find_centers(traced).mean.converged, size < 0.01);
  }
}

/// Points on a straight line determine no circle.
TEST(FitAndAverageLampCircleCenters, UsesHeightOnlyIfMostOfItsCirclesAreDetermined) {
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

/// Outliers of a height that is not used are not reported. The residual is that of the other
/// height.
TEST(FitAndAverageLampCircleCenters, OmitsOutliersAndResidualsOfUnusedHeight) {
  const auto angles = make_equal_angles(9);
  TracedCaptures traced(2, 2);
  for (const std::size_t height : {std::size_t{0}, std::size_t{1}}) {
    for (const double angle : angles) traced.add_capture(angle, height);
  }
  std::vector<double> deviations;
  for (int i = 0; i < 9; ++i) deviations.push_back(1e-3 * std::sin(2 * i + 1));
  traced.add_circle(0, 0, {{0.02, -0.01}, 0.3}, angles, deviations);
  deviations[4] = 0.2;
  traced.add_circle(9, 1, {{0.02, -0.01}, 0.3}, angles, deviations);
  for (std::size_t i = 0; i < 9; ++i) {
    traced.add_point(9 + i, 0, {0.01 * angles[i], 0.02 * angles[i]});
  }
  const CircleCenters found = find_centers(traced);
  ASSERT_TRUE(found.mean.converged);
  EXPECT_EQ(found.undetermined, 1);
  ASSERT_EQ(found.circles.size(), 1U);
  EXPECT_TRUE(found.mean.outliers.empty());
  EXPECT_EQ(found.mean.used_observations.size(), 9U);
  EXPECT_NEAR(found.mean.residual_px, kFocalX_px * found.circles[0].fit.rms * std::sqrt(9. / 6),
              1e-9);
  EXPECT_NEAR(found.spread_px, 0, 1e-9);
}

}  // namespace
}  // namespace vlp
