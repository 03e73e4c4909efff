// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Covariances of the offsets from derivatives of the fixes, and the members of the results.
#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calibration/dispersion/offset_separation.h"
#include "calibration/dispersion/reference_point_fixes.h"
#include "calibration/dispersion/station.h"
#include "geometry/enclosing_circle.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns a station whose camera has different focal lengths along x and y.
Station make_station_with_unequal_focal_lengths() {
  Station station(0.01);
  for (Calibration* calibration : {&station.rig.calibration, &station.believed}) {
    calibration->camera.intrinsics[0] = 560;
    calibration->camera.intrinsics[1] = 480;
  }
  return station;
}

void add_noise(std::vector<ReferencePointCapture>& captures, std::uint64_t seed) {
  Random random(seed);
  for (auto& capture : captures) capture.detections = with_noise(capture.detections, random);
}

/// Returns the derivative of each fix with respect to the offset, from steps of 1 px.
std::vector<Eigen::Matrix2d> differentiate_fixes_by_offset(const ReferencePointFixes& fixes,
                                                           const Eigen::Vector2d& offset_px) {
  std::vector<Eigen::Matrix2d> derivatives;
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step_px = Eigen::Vector2d::Unit(axis);
    const OptionalFixes plus =
                            fixes.compute_capture_fixes_with_dispersion_offset(offset_px + step_px),
                        minus =
                            fixes.compute_capture_fixes_with_dispersion_offset(offset_px - step_px);
    derivatives.resize(plus.size());
    for (std::size_t i = 0; i < plus.size(); ++i) {
      if (plus[i] && minus[i]) {
        derivatives[i].col(axis) = (plus[i]->error_m - minus[i]->error_m) / 2;
      }
    }
  }
  return derivatives;
}

TEST(SeparateCameraAndWorldOffsets, CovarianceAndVarianceFactorMatchDerivativesOfFixes) {
  Station station = make_station_with_unequal_focal_lengths();
  auto captures = station.captures(7, true, {0.004, -0.003}, 0.1);
  for (Detection& detection : captures[2].detections) detection.sigma_px = 0.4;
  add_noise(captures, 51);
  captures[4].detections.clear();
  const ReferencePointFixes fixes(captures, station.rig.map, station.believed);
  const auto found = separate_camera_and_world_offsets(fixes);
  ASSERT_TRUE(found);
  const std::vector<bool> expected_used = {true, true, true, true, false, true, true};
  EXPECT_EQ(found->used, expected_used);
  EXPECT_EQ(found->degrees_of_freedom, 12 - 4);
  const auto at = fixes.compute_capture_fixes_with_dispersion_offset(found->offset_px);
  const auto derivatives = differentiate_fixes_by_offset(fixes, found->offset_px);
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  double chi_squared = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (!at[i]) continue;
    Eigen::Matrix<double, 2, 4> jacobian;
    jacobian << derivatives[i], -Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d weight = at[i]->covariance.inverse();
    const Eigen::Vector2d residual_m = at[i]->error_m - found->world_m;
    information += jacobian.transpose() * weight * jacobian;
    gradient += jacobian.transpose() * weight * residual_m;
    chi_squared += residual_m.dot(weight * residual_m);
  }
  const Eigen::Matrix4d covariance = information.inverse();
  expect_relatively_near(found->covariance.topLeftCorner<2, 2>(), covariance.topLeftCorner<2, 2>(),
                         1e-3);
  expect_relatively_near(found->covariance.bottomRightCorner<2, 2>(),
                         covariance.bottomRightCorner<2, 2>(), 1e-3);
  expect_relatively_near(found->covariance.topRightCorner<2, 2>(),
                         covariance.topRightCorner<2, 2>(), 1e-3);
  EXPECT_GT(found->variance_factor, 0.2);
  EXPECT_NEAR(found->variance_factor, chi_squared / 8, 1e-9 * chi_squared);
  // Remaining step in standard deviations. The gradient is zero at the solution.
  const Eigen::Vector4d step = covariance * gradient;
  EXPECT_THAT(step.cwiseQuotient(covariance.diagonal().cwiseSqrt()),
              IsNear(Eigen::Vector4d::Zero(), 1e-3));
}

/// Errors of 5 standard deviations are within the bound of few fixes, errors of 30 are not.
TEST(SeparateCameraAndWorldOffsets, RejectedFixesHaveNoEffect) {
  Station station(0.01);
  auto captures = station.captures(12, true, {0.004, -0.003}, 0.1);
  add_noise(captures, 52);
  const auto clean = ReferencePointFixes(captures, station.rig.map, station.believed)
                         .compute_capture_fixes_with_dispersion_offset({0, 0});
  ASSERT_TRUE(clean[3] && clean[8]);
  const double sd_m = std::sqrt(clean[3]->covariance.trace() / 2);
  for (const double sigmas : {5., 30.}) {
    auto displaced = captures;
    displaced[3].reference_point_m.x() += sigmas * sd_m;
    displaced[8].reference_point_m.y() -= sigmas * sd_m;
    const auto found = separate_camera_and_world_offsets(
        ReferencePointFixes(displaced, station.rig.map, station.believed));
    ASSERT_TRUE(found);
    std::vector<bool> used(12, true);
    if (sigmas > 10) used[3] = used[8] = false;
    EXPECT_EQ(found->used, used) << sigmas;
    EXPECT_EQ(found->degrees_of_freedom, sigmas > 10 ? 2 * 10 - 4 : 2 * 12 - 4);
    if (sigmas < 10) continue;
    auto others = captures;
    others.erase(others.begin() + 8);
    others.erase(others.begin() + 3);
    const auto expected = separate_camera_and_world_offsets(
        ReferencePointFixes(others, station.rig.map, station.believed));
    ASSERT_TRUE(expected);
    EXPECT_THAT(found->offset_px, IsNear(expected->offset_px, 1e-5));
    EXPECT_THAT(found->world_m, IsNear(expected->world_m, 1e-8));
    EXPECT_NEAR(found->variance_factor, expected->variance_factor, 1e-5);
    EXPECT_LT(found->variance_factor, 3);
  }
}

/// Two captures determine four unknowns without redundancy.
TEST(SeparateCameraAndWorldOffsets, VarianceFactorIsZeroForTwoCaptures) {
  Station station(0.01);
  const auto captures = station.captures(2, false, {0.004, -0.003}, 0.1);
  const auto found = separate_camera_and_world_offsets(
      ReferencePointFixes(captures, station.rig.map, station.believed));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->degrees_of_freedom, 0);
  EXPECT_EQ(found->variance_factor, 0);
  EXPECT_THAT(found->world_m, IsNear(Eigen::Vector2d(0.004, -0.003), 1e-9));
  EXPECT_TRUE(found->lamp_derivatives.lamps.empty());
}

TEST(SeparateCameraAndWorldOffsets, ReturnsNulloptWithoutFixes) {
  Station station(0.01);
  auto captures = station.captures(4, false, {0, 0});
  for (auto& capture : captures) capture.detections.clear();
  EXPECT_FALSE(separate_camera_and_world_offsets(
      ReferencePointFixes(captures, station.rig.map, station.believed)));
  EXPECT_FALSE(separate_camera_and_world_offsets(
      ReferencePointFixes({}, station.rig.map, station.believed)));
}

TEST(FitCircleToDispersedFixes, CenterIsMeanOrThatOfSmallestEnclosingCircle) {
  const std::vector<Eigen::Vector2d> points = {{0, 0}, {4, 0}, {1, 1}, {3, 3}};
  const Circle mean = fit_circle_to_dispersed_fixes(points, DispersionCircle::mean);
  EXPECT_THAT(mean.center, IsNear(Eigen::Vector2d(2, 1), 1e-12));
  EXPECT_NEAR(mean.radius, std::sqrt(5.), 1e-12);
  const Circle enclosing = fit_circle_to_dispersed_fixes(points, DispersionCircle::enclosing);
  EXPECT_THAT(enclosing.center, IsNear(Eigen::Vector2d(2, 1), 1e-9));
  EXPECT_NEAR(enclosing.radius, std::sqrt(5.), 1e-9);
  const std::vector<Eigen::Vector2d> line = {{0, 0}, {1, 0}, {5, 0}};
  EXPECT_THAT(fit_circle_to_dispersed_fixes(line, DispersionCircle::mean).center,
              IsNear(Eigen::Vector2d(2, 0), 1e-12));
  EXPECT_NEAR(fit_circle_to_dispersed_fixes(line, DispersionCircle::mean).radius, 3, 1e-12);
  EXPECT_NEAR(fit_circle_to_dispersed_fixes(line, DispersionCircle::enclosing).radius, 2.5, 1e-9);
}

/// Captures at one yaw, with noise.
struct NoisyYaw {
  NoisyYaw(int count, double size_px, std::size_t lamps = 8)
      : station(make_station_with_unequal_focal_lengths()),
        captures(station.captures_at(0.7, count, size_px)) {
    for (auto& capture : captures) capture.detections.resize(lamps);
    add_noise(captures, 53);
  }
  /// Sets sigma_px of all detections.
  void state_noise(std::optional<double> sigma_px) {
    for (auto& capture : captures) {
      for (Detection& detection : capture.detections) detection.sigma_px = sigma_px;
    }
  }
  ReferencePointFixes fixes() const { return {captures, station.rig.map, station.believed}; }
  ChenGuanOffset estimate(bool noise_is_stated,
                          DispersionCircle kind = DispersionCircle::mean) const {
    return estimate_dispersion_offset_by_chen_guan(fixes(), station.believed.camera.focal_px(),
                                                   kind, noise_is_stated);
  }

  Station station;
  std::vector<ReferencePointCapture> captures;
};

Eigen::Matrix2d average(const std::vector<Eigen::Matrix2d>& matrices) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (const Eigen::Matrix2d& matrix : matrices) sum += matrix;
  return sum / static_cast<double>(matrices.size());
}

/// Computes the covariance of the offset from the scatter of the fixes, in coordinates in which
/// `noise_scale` times the mean covariance of the fixes is the unit matrix.
Eigen::Matrix2d compute_expected_chen_guan_covariance(const ReferencePointFixes& fixes,
                                                      const Eigen::Vector2d& offset_px,
                                                      double noise_scale) {
  const auto at = fixes.compute_capture_fixes_with_dispersion_offset(offset_px);
  const double n = static_cast<double>(at.size());
  Eigen::Vector2d mean_m(0, 0);
  Eigen::Matrix2d noise = Eigen::Matrix2d::Zero(), squares = noise;
  for (const auto& fix : at) {
    mean_m += fix.value().error_m / n;
    noise += noise_scale * fix.value().covariance / n;
  }
  for (const auto& fix : at) {
    squares += (fix->error_m - mean_m) * (fix->error_m - mean_m).transpose();
  }
  EXPECT_LT(mean_m.norm(), 1e-9);
  const Eigen::Matrix2d scatter =
      (squares + squares.trace() / (n - 1) * Eigen::Matrix2d::Identity()) / (n + 1);
  Eigen::Matrix2d of_mean = Eigen::Matrix2d::Zero();
  if (noise_scale == 0) {
    of_mean = compute_small_sample_variance_factor(1, 2 * n - 2, false) * scatter / n;
  } else {
    const double pooled = (noise.inverse() * squares).trace() / (2 * n - 2);
    // Eigenvectors v of scatter v = lambda noise v have v' noise v = 1.
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter, noise);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const Eigen::Vector2d axis = noise * solver.eigenvectors().col(i);
      of_mean +=
          compute_small_sample_variance_factor(solver.eigenvalues()[i], 2 * n - 2, true, pooled) *
          axis * axis.transpose() / n;
    }
  }
  const Eigen::Matrix2d image_from_floor =
      average(differentiate_fixes_by_offset(fixes, offset_px)).inverse();
  return image_from_floor * of_mean * image_from_floor.transpose();
}

TEST(EstimateDispersionOffsetByChenGuan, CovarianceMatchesScatterAndStatedNoiseOfFixes) {
  for (const int count : {2, 4, 9}) {
    // Noise as stated, and three times as large.
    for (const double sigma_px : {0.1, 0.03}) {
      SCOPED_TRACE(testing::Message() << count << " captures, " << sigma_px << " px");
      NoisyYaw setup(count, 0.1);
      setup.state_noise(sigma_px);
      const ChenGuanOffset found = setup.estimate(true);
      ASSERT_EQ(found.status, DispersionStatus::ok);
      ASSERT_TRUE(found.covariance);
      EXPECT_EQ(found.used, std::vector<bool>(static_cast<std::size_t>(count), true));
      EXPECT_EQ((*found.covariance)(0, 1), (*found.covariance)(1, 0));
      expect_relatively_near(
          *found.covariance,
          compute_expected_chen_guan_covariance(setup.fixes(), found.offset_px, 1), 1e-3);
    }
  }
}

TEST(EstimateDispersionOffsetByChenGuan, CovarianceUsesResidualsOfPixelsWithoutStatedNoise) {
  NoisyYaw setup(5, 0.1);
  setup.state_noise({});
  const ChenGuanOffset found = setup.estimate(false);
  ASSERT_EQ(found.status, DispersionStatus::ok);
  ASSERT_TRUE(found.covariance);
  const ReferencePointFixes fixes = setup.fixes();
  double squares_px2 = 0;
  for (const auto& fix : fixes.compute_capture_fixes_with_dispersion_offset(found.offset_px)) {
    ASSERT_TRUE(fix);
    squares_px2 += fix->squared_residuals_px2;
  }
  constexpr double freedom = 5 * (2 * 8 - 4);  // five fixes of eight lamps
  EXPECT_NEAR(std::sqrt(squares_px2 / freedom), 0.1, 0.05);
  expect_relatively_near(
      *found.covariance,
      compute_expected_chen_guan_covariance(fixes, found.offset_px, squares_px2 / freedom), 1e-3);
}

/// Fixes of two lamps have no residuals, so that only their scatter counts.
TEST(EstimateDispersionOffsetByChenGuan, CovarianceUsesOnlyScatterForTwoLampsWithoutStatedNoise) {
  NoisyYaw setup(5, 0.1, 2);
  setup.state_noise({});
  const ChenGuanOffset found = setup.estimate(false);
  ASSERT_EQ(found.status, DispersionStatus::ok);
  ASSERT_TRUE(found.covariance);
  expect_relatively_near(*found.covariance,
                         compute_expected_chen_guan_covariance(setup.fixes(), found.offset_px, 0),
                         1e-3);
}

TEST(EstimateDispersionOffsetByChenGuan, LampDerivativesMatchOffsetsWithMovedLamps) {
  NoisyYaw setup(3, 0.1);
  setup.captures.push_back(setup.captures[1]);
  setup.captures.back().reference_point_m.x() += 0.5;  // is rejected
  for (Lamp& lamp : setup.station.rig.map.lamps) lamp.sd_m = 0.002;
  setup.station.rig.map.lamps[1].sd_m.reset();
  const ChenGuanOffset found = setup.estimate(true);
  ASSERT_EQ(found.status, DispersionStatus::ok);
  const std::vector<bool> used = {true, true, true, false};
  EXPECT_EQ(found.used, used);
  const Eigen::MatrixXd& jacobian = found.lamp_derivatives.jacobian_wrt_positions;
  ASSERT_EQ(found.lamp_derivatives.lamps.size(), 7U);
  ASSERT_EQ(jacobian.rows(), 2);
  ASSERT_EQ(jacobian.cols(), 21);
  const LampMap map = setup.station.rig.map;
  Eigen::MatrixXd expected(2, 21);
  for (Eigen::Index column = 0; column < 21; ++column) {
    const std::size_t lamp = column < 3 ? 0 : static_cast<std::size_t>(column / 3) + 1;
    constexpr double step_m = 1e-4;
    setup.station.rig.map.lamps[lamp].position_m[column % 3] += step_m;
    const ChenGuanOffset plus = setup.estimate(true);
    setup.station.rig.map.lamps[lamp].position_m[column % 3] -= 2 * step_m;
    const ChenGuanOffset minus = setup.estimate(true);
    setup.station.rig.map = map;
    ASSERT_EQ(plus.used, used);
    ASSERT_EQ(minus.used, used);
    expected.col(column) = (plus.offset_px - minus.offset_px) / (2 * step_m);
  }
  expect_relatively_near(jacobian, expected, 2e-3);
}

TEST(EstimateDispersionOffsetByChenGuan, EnclosingCircleHasNoCovariance) {
  const NoisyYaw setup(5, 0.1);
  const ChenGuanOffset found = setup.estimate(true, DispersionCircle::enclosing);
  ASSERT_EQ(found.status, DispersionStatus::ok);
  EXPECT_FALSE(found.covariance);
  EXPECT_TRUE(found.lamp_derivatives.lamps.empty());
  std::vector<Eigen::Vector2d> errors_m;
  for (const auto& fix :
       setup.fixes().compute_capture_fixes_with_dispersion_offset(found.offset_px)) {
    ASSERT_TRUE(fix);
    errors_m.push_back(fix->error_m);
  }
  EXPECT_LT(compute_enclosing_circle(errors_m).center.norm(), 1e-9);
  EXPECT_GT((found.offset_px - setup.estimate(true).offset_px).norm(), 1e-3);
}

TEST(EstimateDispersionOffsetByChenGuan, ReportsSeveralYawsOrDiverged) {
  NoisyYaw setup(1, 0.1);
  EXPECT_EQ(setup.estimate(true).status, DispersionStatus::diverged) << "a single fix";
  for (const auto& capture : setup.station.captures_at(1.5, 1)) setup.captures.push_back(capture);
  EXPECT_EQ(setup.estimate(true).status, DispersionStatus::several_yaws);
}

TEST(EstimateDispersionOffset, CameraMethodCovariancesIncludeSmallSampleFactorAndMap) {
  for (const double sigma_px : {0.1, 0.03}) {
    Station station = make_station_with_unequal_focal_lengths();
    auto captures = station.captures(7, true, {0.004, -0.003}, 0.1);
    add_noise(captures, 54);
    for (auto& capture : captures) {
      for (Detection& detection : capture.detections) detection.sigma_px = sigma_px;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      station.rig.map.lamps[i].sd_m = 1e-4 * (1 + static_cast<double>(i));
    }
    const auto fit = estimate_dispersion_offset(captures, station.rig.map, station.believed,
                                                DispersionMethod::camera);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    EXPECT_TRUE(fit.noise_is_stated);
    ASSERT_TRUE(fit.covariance && fit.world_offset_m);
    const auto separation = separate_camera_and_world_offsets(
        ReferencePointFixes(captures, station.rig.map, station.believed));
    ASSERT_TRUE(separation);
    ASSERT_EQ(separation->degrees_of_freedom, 10);
    const double factor =
        compute_small_sample_variance_factor(separation->variance_factor, 10, true);
    EXPECT_EQ(factor > 3, sigma_px < 0.1);
    EXPECT_EQ(fit.dispersion.offset_px, separation->offset_px);
    EXPECT_EQ(*fit.world_offset_m, separation->world_m);
    expect_relatively_near(*fit.covariance, factor * separation->covariance.topLeftCorner<2, 2>(),
                           1e-9);
    EXPECT_EQ((*fit.covariance)(0, 1), (*fit.covariance)(1, 0));
    Eigen::Matrix2d world = factor * separation->covariance.bottomRightCorner<2, 2>();
    const Eigen::MatrixXd& jacobian = separation->lamp_derivatives.jacobian_wrt_positions;
    ASSERT_EQ(jacobian.cols(), 12);
    ASSERT_EQ(fit.lamp_derivatives.lamps.size(), 4U);
    EXPECT_EQ(fit.lamp_derivatives.jacobian_wrt_positions, jacobian.topRows(2));
    for (Eigen::Index i = 0; i < 4; ++i) {
      const Lamp& lamp = fit.lamp_derivatives.lamps[static_cast<std::size_t>(i)];
      EXPECT_EQ(lamp.id, i + 1);
      const Eigen::Matrix<double, 2, 3> change = *lamp.sd_m * jacobian.block<2, 3>(2, 3 * i);
      world += change * change.transpose();
    }
    expect_relatively_near(fit.world_covariance, world, 1e-9);
  }
}

TEST(EstimateDispersionOffset, ChenGuanMethodReturnsOffsetCovarianceAndLamps) {
  NoisyYaw setup(5, 0.1);
  setup.station.rig.map.lamps[3].sd_m = 0.002;
  const auto fit = estimate_dispersion_offset(setup.captures, setup.station.rig.map,
                                              setup.station.believed, DispersionMethod::chen_guan);
  ASSERT_EQ(fit.status, DispersionStatus::ok);
  const ChenGuanOffset expected = setup.estimate(true);
  ASSERT_TRUE(fit.covariance && expected.covariance);
  EXPECT_EQ(fit.dispersion.offset_px, expected.offset_px);
  EXPECT_EQ(*fit.covariance, *expected.covariance);
  EXPECT_FALSE(fit.world_offset_m);
  ASSERT_EQ(fit.lamp_derivatives.lamps.size(), 1U);
  EXPECT_EQ(fit.lamp_derivatives.lamps[0].id, 4);
  // Without stated noise of one detection.
  setup.captures[4].detections[7].sigma_px.reset();
  const auto unstated = estimate_dispersion_offset(
      setup.captures, setup.station.rig.map, setup.station.believed, DispersionMethod::chen_guan);
  ASSERT_EQ(unstated.status, DispersionStatus::ok);
  EXPECT_FALSE(unstated.noise_is_stated);
  ASSERT_TRUE(unstated.covariance);
  const ChenGuanOffset expected_unstated = setup.estimate(false);
  ASSERT_TRUE(expected_unstated.covariance);
  EXPECT_EQ(*unstated.covariance, *expected_unstated.covariance);
}

/// One capture without a fix and one with a wrong reference point.
TEST(EstimateDispersionOffset, ReturnsFixesAndCirclesBeforeAndAfterCorrection) {
  for (const DispersionCircle kind : {DispersionCircle::mean, DispersionCircle::enclosing}) {
    Station station = make_station_with_unequal_focal_lengths();
    auto captures = station.captures(9, true, {0.004, -0.003}, 0.1);
    add_noise(captures, 55);
    captures[2].detections.resize(1);
    captures[5].reference_point_m.y() += 0.2;
    const auto fit = estimate_dispersion_offset(captures, station.rig.map, station.believed,
                                                DispersionMethod::camera, kind);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    EXPECT_EQ(fit.captures_without_fix, 1);
    EXPECT_EQ(fit.no_fix_status, FixStatus::too_few_lamps);
    ASSERT_EQ(fit.fixes.size(), 8U);
    const ReferencePointFixes fixes(captures, station.rig.map, station.believed);
    const auto before = fixes.compute_capture_fixes_with_dispersion_offset({0, 0}),
               after = fixes.compute_capture_fixes_with_dispersion_offset(fit.dispersion.offset_px);
    std::vector<Eigen::Vector2d> used_before_m, used_after_m;
    for (std::size_t i = 0; i < 8; ++i) {
      const auto& [capture, before_m, after_m, used] = fit.fixes[i];
      ASSERT_EQ(capture, i < 2 ? i : i + 1);
      ASSERT_TRUE(before[capture] && after[capture]);
      EXPECT_EQ(before_m, before[capture]->error_m);
      EXPECT_EQ(after_m, after[capture]->error_m);
      EXPECT_EQ(used, capture != 5);
      if (!used) continue;
      used_before_m.push_back(before_m);
      used_after_m.push_back(after_m);
    }
    const Circle circle_before = fit_circle_to_dispersed_fixes(used_before_m, kind),
                 circle_after = fit_circle_to_dispersed_fixes(used_after_m, kind);
    EXPECT_EQ(fit.before.center, circle_before.center);
    EXPECT_EQ(fit.before.radius, circle_before.radius);
    EXPECT_EQ(fit.after.center, circle_after.center);
    EXPECT_EQ(fit.after.radius, circle_after.radius);
    EXPECT_GT(fit.before.radius, 2 * fit.after.radius);
    EXPECT_EQ(fit.dispersion.center_m, fit.before.center);
    EXPECT_EQ(fit.dispersion.radius_m, fit.before.radius);
    EXPECT_EQ(fit.dispersion.captures, 7);
  }
}

TEST(EstimateDispersionOffset, RequiresThreeCapturesForCameraMethodAndTwoForChenGuan) {
  Station station(0.01);
  const auto find_status = [&](std::vector<ReferencePointCapture> captures, std::size_t count,
                               DispersionMethod method) {
    captures.resize(count);
    return estimate_dispersion_offset(captures, station.rig.map, station.believed, method).status;
  };
  const auto rotated = station.captures(3, false, {0, 0}), at_one_yaw = station.captures_at(1, 3);
  EXPECT_EQ(find_status(rotated, 2, DispersionMethod::camera), DispersionStatus::too_few_captures);
  EXPECT_EQ(find_status(rotated, 3, DispersionMethod::camera), DispersionStatus::ok);
  EXPECT_EQ(find_status(at_one_yaw, 1, DispersionMethod::chen_guan),
            DispersionStatus::too_few_captures);
  EXPECT_EQ(find_status(at_one_yaw, 2, DispersionMethod::chen_guan), DispersionStatus::ok);
  // Only captures with a fix count.
  auto without_lamps = rotated;
  without_lamps[1].detections.clear();
  EXPECT_EQ(find_status(without_lamps, 3, DispersionMethod::camera),
            DispersionStatus::too_few_captures);
}

/// Captures at one yaw, and two outliers at other yaws. The inliers do not determine the offset.
TEST(EstimateDispersionOffset, FailsIfOnlyRejectedCapturesHaveOtherYaws) {
  for (const bool noisy : {false, true}) {
    Station station(0.01);
    auto captures = station.captures_at(1, 12);
    for (const double yaw_rad : {2.5, 4.}) {
      captures.push_back(station.captures_at(yaw_rad, 1)[0]);
      captures.back().reference_point_m[yaw_rad < 3 ? 0 : 1] += 0.1;
    }
    if (noisy) add_noise(captures, 56);
    const auto fit = estimate_dispersion_offset(captures, station.rig.map, station.believed,
                                                DispersionMethod::camera);
    // Rounding errors decide if the equations are singular.
    EXPECT_THAT(fit.status,
                testing::AnyOf(DispersionStatus::single_yaw, DispersionStatus::diverged));
    EXPECT_FALSE(fit.world_offset_m);
    EXPECT_TRUE(fit.fixes.empty());
  }
}

TEST(DescribeDispersionStatus, DescribesEachStatusDifferently) {
  std::set<std::string> descriptions;
  for (const auto status :
       {DispersionStatus::ok, DispersionStatus::no_fix, DispersionStatus::too_few_captures,
        DispersionStatus::all_far_from_reference, DispersionStatus::single_yaw,
        DispersionStatus::several_yaws, DispersionStatus::diverged}) {
    descriptions.emplace(describe_dispersion_status(status));
  }
  EXPECT_EQ(descriptions.size(), 7U);
  EXPECT_FALSE(descriptions.contains(""));
  EXPECT_THAT(std::string(describe_dispersion_status(DispersionStatus::several_yaws)),
              testing::HasSubstr("use one yaw"));
}

}  // namespace
}  // namespace vlp
