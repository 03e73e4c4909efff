// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the members of dispersion fits with position fixes and with a dense solution.
#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calibration/dispersion/station.h"
#include "geometry/enclosing_circle.h"
#include "positioning/positioner.h"
#include "support/least_squares_oracle.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Station whose camera has different focal lengths along x and y, with captures of noise 0.1 px.
struct NoisyStation : Station {
  NoisyStation() : Station(0.01) {
    for (Calibration* calibration : {&rig.calibration, &believed}) {
      calibration->camera.intrinsics[0] = 560;
      calibration->camera.intrinsics[1] = 480;
    }
  }
  void add_noise(std::uint64_t seed) {
    Random random(seed);
    for (auto& capture : noisy) capture.detections = with_noise(capture.detections, random);
  }
  void state_noise(std::optional<double> sigma_px) {
    for (auto& capture : noisy) {
      for (Detection& detection : capture.detections) detection.sigma_px = sigma_px;
    }
  }
  DispersionFit fit(DispersionMethod method,
                    DispersionCircle circle = DispersionCircle::mean) const {
    return estimate_dispersion(noisy, rig.map, believed, method, circle);
  }
  /// Returns the fix of a capture with this offset.
  Fix compute_fix(const ReferencePointCapture& capture, const Eigen::Vector2d& offset_px) const {
    Calibration calibration = believed;
    calibration.dispersion = Dispersion{offset_px, 0, {0, 0}, 1};
    return Positioner(rig.map, calibration).compute_position_fix(capture.detections);
  }
  Eigen::Vector2d compute_error_m(const ReferencePointCapture& capture,
                                  const Eigen::Vector2d& offset_px) const {
    return compute_fix(capture, offset_px).state.pose.position_m.head<2>() -
           capture.reference_point_m;
  }

  std::vector<ReferencePointCapture> noisy;
};

/// Ratio of the squared 97.5 % bounds of Student's t (Wallace's approximation) and of the normal
/// distribution.
double compute_student_ratio(double freedom) {
  const double z_squared = std::pow(1.96 * (1 + 2 / (8 * freedom + 1)), 2);
  return freedom * (std::exp(z_squared / freedom) - 1) / (1.96 * 1.96);
}

/// Noise as stated, a third of it stated, and none stated. Few captures widen the variance:
/// compute_variance_factor().
TEST(EstimateDispersion, CameraMethodMatchesDenseSolution) {
  for (const std::optional<double> sigma_px :
       {std::optional(0.1), std::optional(0.03), std::optional<double>()}) {
    NoisyStation station;
    station.noisy = station.captures(7, true, {0.004, -0.003}, 0.1);
    station.add_noise(54);
    station.state_noise(sigma_px);
    const DispersionFit fit = station.fit(DispersionMethod::camera);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    EXPECT_EQ(fit.noise_is_stated, sigma_px.has_value());
    ASSERT_TRUE(fit.covariance && fit.world_offset_m);
    std::vector<Eigen::Matrix2d> whitening;
    for (const auto& capture : station.noisy) {
      const Fix fix = station.compute_fix(capture, fit.dispersion.offset_px);
      const Eigen::Matrix2d root =
          Eigen::Matrix2d(fix.noise_covariance.topLeftCorner<2, 2>()).llt().matrixL();
      whitening.emplace_back(root.inverse());
    }
    const DenseSolution dense = solve_least_squares(
        [&](const Eigen::VectorXd& unknowns) {
          Eigen::VectorXd rows(14);
          for (std::size_t i = 0; i < 7; ++i) {
            rows.segment<2>(2 * static_cast<Eigen::Index>(i)) =
                whitening[i] * (station.compute_error_m(station.noisy[i], unknowns.head<2>()) -
                                unknowns.tail<2>());
          }
          return rows;
        },
        Eigen::Vector4d::Zero(), 1e-3);
    const Eigen::Vector4d sd = dense.covariance.diagonal().cwiseSqrt();
    EXPECT_THAT(fit.dispersion.offset_px, IsNear(dense.unknowns.head<2>(), 2e-2 * sd[0]));
    EXPECT_THAT(*fit.world_offset_m, IsNear(dense.unknowns.tail<2>(), 2e-2 * sd[2]));
    const double ratio = dense.residuals.squaredNorm() / 10;
    EXPECT_LT(ratio, 1.3) << "Positioner increases the noise that residuals contradict";
    const double factor = sigma_px
                              ? std::max(1.0, (6 + 10 * ratio) / 16 * compute_student_ratio(16))
                              : ratio * compute_student_ratio(10);
    expect_relatively_near(*fit.covariance, factor * dense.covariance.topLeftCorner<2, 2>(), 0.02);
    EXPECT_EQ((*fit.covariance)(0, 1), (*fit.covariance)(1, 0));
    expect_relatively_near(fit.world_covariance,
                           factor * dense.covariance.bottomRightCorner<2, 2>(), 0.02);
  }
}

/// Exact captures. Four lamps have uncertain positions.
TEST(EstimateDispersion, CameraMethodReturnsLampDerivativesAndAddsMapToWorldCovariance) {
  NoisyStation station;
  station.noisy = station.captures(9, true, {0.004, -0.003}, 0.1);
  const DispersionFit exact_map = station.fit(DispersionMethod::camera);
  ASSERT_EQ(exact_map.status, DispersionStatus::ok);
  EXPECT_TRUE(exact_map.lamp_derivatives.lamps.empty());
  Eigen::VectorXd lamps(12), sds_m(12);
  for (Eigen::Index i = 0; i < 4; ++i) {
    Lamp& lamp = station.rig.map.lamps[static_cast<std::size_t>(i)];
    lamp.sd_m = 1e-4 * (1 + static_cast<double>(i));
    lamps.segment<3>(3 * i) = lamp.position_m;
    sds_m.segment<3>(3 * i).setConstant(*lamp.sd_m);
  }
  const DispersionFit fit = station.fit(DispersionMethod::camera);
  ASSERT_EQ(fit.status, DispersionStatus::ok);
  ASSERT_EQ(fit.lamp_derivatives.lamps.size(), 4U);
  for (int i = 0; i < 4; ++i)
    EXPECT_EQ(fit.lamp_derivatives.lamps[static_cast<std::size_t>(i)].id, i + 1);
  const Eigen::MatrixXd jacobian = differentiate_numerically(
      [&](const Eigen::VectorXd& positions_m) -> Eigen::VectorXd {
        NoisyStation moved = station;
        for (Eigen::Index i = 0; i < 4; ++i) {
          moved.rig.map.lamps[static_cast<std::size_t>(i)].position_m =
              positions_m.segment<3>(3 * i);
        }
        const DispersionFit other = moved.fit(DispersionMethod::camera);
        Eigen::Vector4d values;
        values << other.dispersion.offset_px, other.world_offset_m.value();
        return values;
      },
      lamps, 1e-5);
  EXPECT_THAT(fit.lamp_derivatives.jacobian_wrt_positions, IsNear(jacobian.topRows<2>(), 0.5));
  const Eigen::MatrixXd scaled = jacobian * sds_m.asDiagonal();
  EXPECT_THAT(fit.lamp_derivatives.scale_by_lamp_sds(),
              IsNear(fit.lamp_derivatives.jacobian_wrt_positions * sds_m.asDiagonal(), 1e-15));
  const Eigen::MatrixXd map_m2 = scaled.bottomRows<2>() * scaled.bottomRows<2>().transpose();
  expect_relatively_near(fit.world_covariance - exact_map.world_covariance, map_m2, 0.01);
}

/// Three captures at one yaw, and one that is rejected. One lamp has no sd_m.
TEST(EstimateDispersion, ChenGuanMethodCentersFixesAndReturnsLampDerivatives) {
  NoisyStation station;
  station.noisy = station.captures_at(0.7, 3, 0.1);
  station.add_noise(53);
  station.noisy.push_back(station.noisy[1]);
  station.noisy.back().reference_point_m.x() += 0.5;
  for (Lamp& lamp : station.rig.map.lamps) lamp.sd_m = 0.002;
  station.rig.map.lamps[1].sd_m.reset();
  const DispersionFit fit = station.fit(DispersionMethod::chen_guan);
  ASSERT_EQ(fit.status, DispersionStatus::ok);
  EXPECT_TRUE(fit.covariance);
  EXPECT_FALSE(fit.world_offset_m);
  EXPECT_EQ(fit.dispersion.captures, 3);
  Eigen::Vector2d mean_m(0, 0);
  for (std::size_t i = 0; i < 3; ++i)
    mean_m += station.compute_error_m(station.noisy[i], fit.dispersion.offset_px) / 3;
  EXPECT_LT(mean_m.norm(), 1e-9);
  ASSERT_EQ(fit.lamp_derivatives.lamps.size(), 7U);
  const Eigen::MatrixXd expected = differentiate_numerically(
      [&](const Eigen::VectorXd& position_m) -> Eigen::VectorXd {
        NoisyStation moved = station;
        moved.rig.map.lamps[2].position_m = position_m;
        return moved.fit(DispersionMethod::chen_guan).dispersion.offset_px;
      },
      station.rig.map.lamps[2].position_m, 1e-4);
  expect_relatively_near(fit.lamp_derivatives.jacobian_wrt_positions.middleCols<3>(3), expected,
                         5e-3);
  const DispersionFit enclosing =
      station.fit(DispersionMethod::chen_guan, DispersionCircle::enclosing);
  ASSERT_EQ(enclosing.status, DispersionStatus::ok);
  EXPECT_FALSE(enclosing.covariance);
  EXPECT_TRUE(enclosing.lamp_derivatives.lamps.empty());
  std::vector<Eigen::Vector2d> errors_m;
  for (std::size_t i = 0; i < 3; ++i) {
    errors_m.push_back(station.compute_error_m(station.noisy[i], enclosing.dispersion.offset_px));
  }
  EXPECT_LT(enclose_in_circle(errors_m).center.norm(), 1e-9);
}

/// Fixes of two lamps have no residuals, so that only their scatter counts. It includes the
/// isotropic mean with the weight of three fixes.
TEST(EstimateDispersion, ChenGuanMethodCovarianceMatchesScatterOfTwoLampFixes) {
  NoisyStation station;
  station.noisy = station.captures_at(0.7, 5, 0.1);
  for (auto& capture : station.noisy) capture.detections.resize(2);
  station.add_noise(53);
  station.state_noise({});
  const DispersionFit fit = station.fit(DispersionMethod::chen_guan);
  ASSERT_EQ(fit.status, DispersionStatus::ok);
  ASSERT_TRUE(fit.covariance);
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();  // the mean is zero
  for (const auto& capture : station.noisy) {
    const Eigen::Vector2d error_m = station.compute_error_m(capture, fit.dispersion.offset_px);
    squares += error_m * error_m.transpose();
  }
  const Eigen::Matrix2d scatter = (squares + squares.trace() / 4 * Eigen::Matrix2d::Identity()) / 6;
  const Eigen::Matrix2d image_from_floor =
      differentiate_numerically(
          [&](const Eigen::VectorXd& offset_px) -> Eigen::VectorXd {
            Eigen::Vector2d mean_m(0, 0);
            for (const auto& capture : station.noisy)
              mean_m += station.compute_error_m(capture, offset_px) / 5;
            return mean_m;
          },
          fit.dispersion.offset_px, 1)
          .inverse();
  expect_relatively_near(
      *fit.covariance,
      compute_student_ratio(8) / 5 * image_from_floor * scatter * image_from_floor.transpose(),
      1e-3);
}

/// One capture without a fix and one with a wrong reference point.
TEST(EstimateDispersion, ReturnsFixesAndCirclesBeforeAndAfterCorrection) {
  for (const DispersionCircle kind : {DispersionCircle::mean, DispersionCircle::enclosing}) {
    NoisyStation station;
    station.noisy = station.captures(9, true, {0.004, -0.003}, 0.1);
    station.add_noise(55);
    station.noisy[2].detections.resize(1);
    station.noisy[5].reference_point_m.y() += 0.2;
    const DispersionFit fit = station.fit(DispersionMethod::camera, kind);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    EXPECT_EQ(fit.captures_without_fix, 1);
    EXPECT_EQ(fit.no_fix_status, FixStatus::too_few_lamps);
    EXPECT_EQ(fit.dispersion.captures, 7);
    ASSERT_EQ(fit.fixes.size(), 8U);
    std::vector<Eigen::Vector2d> before_m, after_m;
    for (std::size_t i = 0; i < 8; ++i) {
      const auto& capture = fit.fixes[i].capture;
      ASSERT_EQ(capture, i < 2 ? i : i + 1);
      EXPECT_THAT(fit.fixes[i].before_m,
                  IsNear(station.compute_error_m(station.noisy[capture], {0, 0}), 1e-9));
      EXPECT_THAT(
          fit.fixes[i].after_m,
          IsNear(station.compute_error_m(station.noisy[capture], fit.dispersion.offset_px), 1e-9));
      EXPECT_EQ(fit.fixes[i].used, capture != 5);
      if (capture == 5) continue;
      before_m.push_back(fit.fixes[i].before_m);
      after_m.push_back(fit.fixes[i].after_m);
    }
    for (const auto& [points_m, circle] :
         {std::pair(before_m, fit.before), std::pair(after_m, fit.after)}) {
      Circle expected = enclose_in_circle(points_m);
      if (kind == DispersionCircle::mean) {
        expected = {{0, 0}, 0};
        for (const Eigen::Vector2d& point_m : points_m) expected.center += point_m / 7;
        for (const Eigen::Vector2d& point_m : points_m)
          expected.radius = std::max(expected.radius, (point_m - expected.center).norm());
      }
      EXPECT_THAT(circle.center, IsNear(expected.center, 1e-9));
      EXPECT_NEAR(circle.radius, expected.radius, 1e-9);
    }
    EXPECT_GT(fit.before.radius, 2 * fit.after.radius);
    EXPECT_EQ(fit.dispersion.center_m, fit.before.center);
    EXPECT_EQ(fit.dispersion.radius_m, fit.before.radius);
  }
}

TEST(DescribeDispersionStatus, DescribesEachStatusDifferently) {
  std::set<std::string> descriptions{""};
  for (const auto status :
       {DispersionStatus::ok, DispersionStatus::no_fix, DispersionStatus::too_few_captures,
        DispersionStatus::all_far_from_reference, DispersionStatus::single_yaw,
        DispersionStatus::several_yaws, DispersionStatus::diverged}) {
    EXPECT_TRUE(descriptions.emplace(describe_status(status)).second);
  }
}

/// Both methods, other focal lengths and other reference points.
TEST(PredictOffset, MatchesNewEstimateForChangedLensAndPosition) {
  for (const DispersionMethod method : {DispersionMethod::camera, DispersionMethod::chen_guan}) {
    NoisyStation station;
    station.noisy = method == DispersionMethod::camera
                        ? station.captures(7, true, {0.004, -0.003}, 0.1)
                        : station.captures_at(0.3, 6, 0.1);
    station.add_noise(55);
    const DispersionFit fit = station.fit(method);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    const Eigen::Vector2d focal_px = station.believed.camera.focal_px();
    std::vector<ReferencePointCapture> captures = fit.captures;
    captures[2].reference_point_m += Eigen::Vector2d(2e-5, -3e-5);
    station.believed.camera.intrinsics[0] += 0.05;
    station.believed.camera.intrinsics[3] += 0.02;
    const auto predicted =
        predict_offset(fit, focal_px, captures, station.rig.map, station.believed);
    station.noisy = captures;
    const DispersionFit other = station.fit(method);
    ASSERT_TRUE(predicted && other.status == DispersionStatus::ok);
    const Eigen::Vector2d before = fit.dispersion.offset_px.cwiseQuotient(focal_px),
                          expected = other.dispersion.offset_px.cwiseQuotient(
                              station.believed.camera.focal_px());
    EXPECT_GT((expected - before).norm(), 1e-6);
    EXPECT_THAT(*predicted, IsNear(expected, 0.01 * (expected - before).norm()));
  }
}

}  // namespace
}  // namespace vlp
