// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares each field of the result of adjust_bundle() with a dense solution of its
/// equations.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "calibration/adjustment/adjustment_room.h"
#include "camera/lens.h"
#include "geometry/statistical_bounds.h"
#include "support/least_squares_oracle.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

class AdjustBundleResult : public AdjustmentRoom {
 protected:
  AdjustmentResult adjust(const AdjustmentLimits& limits = {}) const {
    AdjustmentResult found = adjust_bundle(input, limits);
    EXPECT_TRUE(found.has_succeeded()) << found.undetermined;
    EXPECT_EQ(found.refined_covariance.rows(), 31);
    EXPECT_EQ(found.rejected_detections, 0);
    return found;
  }
};

double compute_max_sd(const Eigen::Matrix2d& covariance) {
  const double mean = covariance.trace() / 2;
  return std::sqrt(mean + std::sqrt(mean * mean - covariance.determinant()));
}

Eigen::VectorXd stack_parameters(const AdjustmentResult& found) {
  Eigen::VectorXd parameters(31);
  parameters << Eigen::Map<const Eigen::VectorXd>(found.camera.intrinsics.data(), 12),
      found.center.zenith_in_camera.hnormalized(), found.center.lever_arm_m.value(),
      Eigen::VectorXd::Zero(15);
  for (std::size_t i = 0; i < 5; ++i) {
    parameters.segment<3>(16 + 3 * static_cast<Eigen::Index>(i)) =
        found.refined_map.lamps[i].position_m;
  }
  return parameters;
}

TEST_F(AdjustBundleResult, EstimatesAndCovarianceMatchDenseSolution) {
  measure(0.05, 0.03);
  const Solution expected = solve(1);
  ASSERT_EQ(expected.noise_scale, 1);
  const Eigen::VectorXd sd = expected.covariance.diagonal().cwiseSqrt();
  for (const bool is_checked : {true, false}) {
    input.captures_are_checked = is_checked;
    const AdjustmentResult found = adjust();
    ASSERT_TRUE(found.center.lever_arm_m);
    ASSERT_EQ(found.refined_map.lamps.size(), kLamps);
    EXPECT_THAT(found.covariance_lamp_ids, testing::ElementsAre(11, 12, 13, 14, 15));
    const Eigen::VectorXd parameters = stack_parameters(found);
    for (Eigen::Index i = 0; i < 31; ++i) {
      EXPECT_NEAR(parameters[i], expected.parameters[i], 1e-11 + 1e-4 * sd[i]) << i;
      for (Eigen::Index j = 0; j < 31; ++j) {
        EXPECT_NEAR(found.refined_covariance(i, j), expected.covariance(i, j),
                    1e-4 * sd[i] * sd[j] + 1e-16);
      }
    }
    EXPECT_EQ(found.refined_covariance, found.refined_covariance.transpose());
    EXPECT_EQ(found.center_covariance, (found.refined_covariance.block<4, 4>(12, 12)));
    EXPECT_EQ(found.center.model, RotationModel::tilt);
    EXPECT_NEAR(found.center.zenith_in_camera.norm(), 1, 1e-15);
    EXPECT_NEAR(found.center.center_px.x(), parameters[2] + parameters[0] * parameters[12], 1e-9);
    EXPECT_NEAR(found.center.center_px.y(), parameters[3] + parameters[1] * parameters[13], 1e-9);
  }
}

TEST_F(AdjustBundleResult, CountsAndResidualMatchDenseSolution) {
  measure(0.05, 0.03);
  const Solution expected = solve(1);
  std::vector<Detection>& fifth = input.captures[5].detections;
  fifth.insert(fifth.begin(), {99, {400, 300}, 0.05});  // not in the map
  fifth.push_back({12, {400, 300}, 0.05});              // the second one of lamp 12
  input.captures.insert(input.captures.begin() + 1, {"dark", {input.captures[0].detections[0]}});
  input.captures_are_checked = true;
  const AdjustmentResult found = adjust();
  EXPECT_EQ(found.captures, 13);
  EXPECT_EQ(found.rejected_captures, 1);
  EXPECT_EQ(found.detections, 64);
  EXPECT_EQ(found.noise_scale, 1);
  EXPECT_FALSE(found.noise_is_contradicted);
  EXPECT_NEAR(found.residual_px, 0.05 * expected.residual, 1e-7);
  EXPECT_NEAR(found.degrees_of_freedom, expected.degrees_of_freedom, 1e-3);
  EXPECT_NEAR(found.lamp_height_m, expected.lamp_height_m, 1e-6);
}

TEST_F(AdjustBundleResult, RefinedLampsAndTheirCovarianceEqualEstimates) {
  measure(0.05, 0.03);
  const AdjustmentResult found = adjust();
  ASSERT_EQ(found.lamps.size(), 5U);
  ASSERT_EQ(found.refined_map.lamps.size(), kLamps);
  EXPECT_EQ(found.refined_map.lamps[5].position_m, input.lamps.lamps[5].position_m);
  EXPECT_EQ(found.refined_map.lamps[5].sd_m, input.lamps.lamps[5].sd_m);
  Eigen::MatrixXd surveyed = found.refined_covariance;
  surveyed.bottomRightCorner<15, 15>().setZero();
  for (std::size_t i = 0; i < 5; ++i) {
    const Lamp &before = input.lamps.lamps[i], &after = found.refined_map.lamps[i];
    const Eigen::Index row = 16 + 3 * static_cast<Eigen::Index>(i);
    surveyed.block<3, 3>(row, row).diagonal().setConstant(*before.sd_m * *before.sd_m);
    const Eigen::Vector3d variances = found.refined_covariance.block<3, 3>(row, row).diagonal();
    EXPECT_EQ(after.id, before.id);
    EXPECT_EQ(found.lamps[i].id, before.id);
    EXPECT_FALSE(found.lamps[i].is_moved);
    EXPECT_THAT(found.lamps[i].correction_m, IsNear(after.position_m - before.position_m, 1e-14));
    EXPECT_EQ(found.lamps[i].correction_m.norm() > 1e-4, i != 1) << "lamp 12 is exact";
    EXPECT_THAT(found.lamps[i].sd_m, IsNear(variances.cwiseSqrt(), 1e-15));
    ASSERT_TRUE(after.sd_m);
    EXPECT_NEAR(*after.sd_m, std::sqrt(variances.mean()), 1e-12);
  }
  EXPECT_THAT(found.surveyed_covariance, IsNear(surveyed, 1e-18));
  EXPECT_THAT(found.notes, testing::SizeIs(1)) << "lamp 16 is in no capture";
}

TEST_F(AdjustBundleResult, LampsWithoutDetectionAreNotEstimated) {
  measure(0.05, 0.03);
  const AdjustmentResult few = adjust();
  for (int i = 0; i < 3000; ++i)
    input.lamps.lamps.push_back({1000 + i, {20. + i, 5, 3}, {}, {}, {}, 0.002});
  const AdjustmentResult many = adjust();
  EXPECT_EQ(many.covariance_lamp_ids, few.covariance_lamp_ids);
  EXPECT_EQ(many.refined_covariance, few.refined_covariance);
  EXPECT_EQ(many.refined_map.lamps.size(), input.lamps.lamps.size());
  EXPECT_THAT(many.notes, testing::SizeIs(1));
}

TEST_F(AdjustBundleResult, KnownPositionsListResidualsOfEachPivotAndPosition) {
  measure(0.05, 0.03);
  const Solution expected = solve(1);
  const AdjustmentResult found = adjust();
  const std::vector<std::string> names{"b",       "a",       "fifth",     "other x",
                                       "other y", "other z", "no height", "axis"};
  ASSERT_EQ(found.known_positions.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto& place = found.known_positions[i];
    EXPECT_EQ(place.name, names[i]);
    EXPECT_EQ(place.captures, i < 3 ? 2 : 1) << names[i];
    EXPECT_EQ(place.measured_point, i == 0 || i == 7 ? MeasuredPoint::axis : MeasuredPoint::camera)
        << names[i];
    EXPECT_FALSE(place.is_outlier) << names[i];
    EXPECT_GT(place.residual_m.norm(), 1e-4);
    EXPECT_THAT(place.residual_m, IsNear(expected.position_residuals_m[i], 1e-7)) << names[i];
  }
}

/// Errors of the focal lengths for which chi-squared is 1, and 3 % below and above its bound.
TEST_F(AdjustBundleResult, LensChiSquaredComparesCorrectionWithItsCovariance) {
  measure(0.05, 0.03);
  const double bound = compute_chi_squared_bound(kSigmasOfOneInTenThousand, 3);
  input.captures_are_checked = true;
  double error_px = 1, expected_at_1_px = 0;
  for (const double fraction : {0.0, 0.97, 1.03}) {
    if (fraction > 0) error_px = std::sqrt(fraction * bound / expected_at_1_px);
    input.calibration.camera.intrinsics[0] = 520 + error_px;
    input.calibration.camera.intrinsics[1] = 522 - error_px;
    const Solution solution = solve(1);
    const Eigen::Matrix3d determined = Eigen::Matrix3d::Identity() - solution.lens_covariance;
    const double expected = solution.lens.dot(determined.inverse() * solution.lens);
    if (fraction == 0) expected_at_1_px = expected;
    const AdjustmentResult found = adjust();
    EXPECT_EQ(found.lens_degrees_of_freedom, 3);
    EXPECT_NEAR(found.lens_chi_squared, expected, 1e-3 * expected);
    EXPECT_EQ(found.lens_is_contradicted, fraction > 1);
  }
}

/// The captures determine a focal length, but no coefficient that is known to 1e-9.
TEST_F(AdjustBundleResult, LensDegreesOfFreedomCountOnlyDeterminedDirections) {
  measure(0.05, 0.03);
  auto& covariance = input.calibration.intrinsics_report->covariance;
  covariance = MatrixX::Zero(12, 12);
  (*covariance)(11, 11) = 1e-18;
  const AdjustmentResult coefficient = adjust();
  EXPECT_EQ(coefficient.lens_degrees_of_freedom, 0);
  EXPECT_EQ(coefficient.lens_chi_squared, 0);
  (*covariance)(1, 1) = 4;
  const AdjustmentResult found = adjust();
  EXPECT_EQ(found.lens_degrees_of_freedom, 1);
  EXPECT_FALSE(found.lens_is_contradicted);
  // The determined variance of fy is the difference between its variances before and after.
  const double correction_px = found.camera.intrinsics[1] - 522;
  EXPECT_GT(std::abs(correction_px), 0);
  const double expected = correction_px * correction_px / (4 - found.refined_covariance(1, 1));
  EXPECT_NEAR(found.lens_chi_squared, expected, 1e-6 * expected);
  input.calibration.intrinsics_report.reset();
  EXPECT_EQ(adjust().camera.intrinsics, input.calibration.camera.intrinsics);
}

TEST_F(AdjustBundleResult, NoiseScaleAndContradictionMatchResidualsForTooSmallSigma) {
  measure(0.005, 0.03);
  const Solution expected = solve(1);
  ASSERT_GT(expected.noise_scale, 3);
  input.captures_are_checked = true;
  const AdjustmentResult found = adjust();
  EXPECT_NEAR(found.noise_scale, expected.noise_scale, 1e-5 * expected.noise_scale);
  EXPECT_TRUE(found.noise_is_contradicted);
  EXPECT_NEAR(found.residual_px, 0.005 * expected.noise_scale * expected.residual, 1e-6);
  const Eigen::Matrix4d center_covariance = expected.covariance.block<4, 4>(12, 12);
  expect_relatively_near(found.center_covariance, center_covariance, 1e-4);
  // Sigmas for which the noise scale is 3 % above and below the limit of the contradiction.
  const double limit = 1 + 3 * std::sqrt(0.5 / expected.degrees_of_freedom);
  for (const double factor : {0.97, 1.03}) {
    measure(0.005 * expected.noise_scale / (limit * factor), 0.03);
    const AdjustmentResult near_limit = adjust();
    EXPECT_NEAR(near_limit.noise_scale / limit, factor, 0.02);
    EXPECT_EQ(near_limit.noise_is_contradicted, factor > 1) << factor;
  }
}

TEST_F(AdjustBundleResult, NoiseScaleIsResidualIfSigmaIsNotGiven) {
  measure(1, 0.03);
  const Solution expected = solve(0);
  // One detection without sigma is enough; the others have the sigma of the assumption.
  input.captures[1].detections[2].sigma_px.reset();
  input.captures_are_checked = true;
  const AdjustmentResult found = adjust();
  EXPECT_LT(found.noise_scale, 0.03);
  EXPECT_NEAR(found.noise_scale, expected.noise_scale, 1e-5 * expected.noise_scale);
  EXPECT_FALSE(found.noise_is_contradicted);
  EXPECT_NEAR(found.residual_px, expected.noise_scale * expected.residual, 1e-6);
}

/// Captures 0 and 7 have given sigmas, which the setting does not change.
TEST_F(AdjustBundleResult, DetectionsWithoutSigmaAreWeightedInUndistortedImage) {
  measure(1, 0.03);
  const Lens lens(input.calibration.camera.lens_model, input.calibration.camera.intrinsics);
  std::vector<Eigen::Matrix2d> whitening;
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    for (Detection& detection : input.captures[k].detections) {
      detection.sigma_px.reset();
      if (k % 7 == 0) detection.sigma_px = 0.8;
      whitening.push_back(
          k % 7 == 0 ? Eigen::Matrix2d(Eigen::Matrix2d::Identity() / 0.8)
                     : Eigen::Matrix2d(differentiate_numerically(
                           [&](const Eigen::VectorXd& pixel) -> Eigen::VectorXd {
                             return Eigen::Vector2d(520, 522).cwiseProduct(
                                 lens.unproject_pixel(pixel).value().direction.hnormalized());
                           },
                           detection.pixel, 1e-3)));
    }
  }
  const Solution expected = solve(0, whitening);
  const double sd = std::sqrt(expected.covariance(12, 12));
  input.captures_are_checked = true;
  const AdjustmentResult equal = adjust();
  input.weighs_in_undistorted_image = true;
  const AdjustmentResult found = adjust();
  const Eigen::Vector2d zenith = expected.parameters.segment<2>(12);
  EXPECT_THAT(found.center.zenith_in_camera.hnormalized(), IsNear(zenith, 1e-3 * sd));
  EXPECT_GT((equal.center.zenith_in_camera.hnormalized() - zenith).norm(), 0.02 * sd);
  // The covariance is that of equal noise in the distorted image.
  expect_relatively_near(found.refined_covariance / std::pow(found.noise_scale, 2),
                         equal.refined_covariance / std::pow(equal.noise_scale, 2), 0.02);
}

TEST_F(AdjustBundleResult, SdLimitsOfZenithAndLeverArmApplyToWorstDirection) {
  measure(0.05, 0.03);
  const AdjustmentResult found = adjust();
  ASSERT_TRUE(found.center.lever_arm_m);
  const double zenith_sd = compute_max_sd(found.refined_covariance.block(12, 12, 2, 2));
  const double arm_fraction =
      compute_max_sd(found.refined_covariance.block(14, 14, 2, 2)) / found.lamp_height_m;
  constexpr double less = 1 - 1e-5, more = 1 + 1e-5;
  EXPECT_EQ(adjust_bundle(input, {zenith_sd * more, 1}).undetermined, "");
  const std::string tilt = adjust_bundle(input, {zenith_sd * less, 1}).undetermined;
  const std::string both =
      adjust_bundle(input, {zenith_sd * less, arm_fraction * less}).undetermined;
  EXPECT_THAT(tilt, testing::Not(testing::AnyOf("", both)));
  EXPECT_NE(both, "");
  EXPECT_TRUE(adjust_bundle(input, {1, arm_fraction * more}).center.lever_arm_m);
  const AdjustmentResult without_arm = adjust({1, arm_fraction * less});
  EXPECT_FALSE(without_arm.center.lever_arm_m);
  EXPECT_EQ(without_arm.center_covariance.rows(), 2);
  Eigen::MatrixXd expected = found.refined_covariance;
  expected.middleRows<2>(14).setZero();
  expected.middleCols<2>(14).setZero();
  EXPECT_THAT(without_arm.refined_covariance, IsNear(expected, 1e-15));
  EXPECT_EQ(without_arm.center.zenith_in_camera, found.center.zenith_in_camera);
}

/// Derivatives by differences, over the centers of 16 x 16 equal parts of the image.
TEST(MakeIntrinsicsCovariance, ReturnsVariancesOfEqualImageDisplacement) {
  const Camera camera = synthetic_camera();
  const Lens lens(camera.lens_model, camera.intrinsics);
  const MatrixX found = make_intrinsics_covariance(camera, 0.5);
  ASSERT_EQ(found.rows(), 12);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(12);
  for (int part = 0; part < 256; ++part) {
    const auto ray = lens.unproject_pixel({50 * (part % 16) + 24.5, 37.5 * (part / 16) + 18.25});
    ASSERT_TRUE(ray);
    const Eigen::MatrixXd jacobian = differentiate_numerically(
        [&](const Eigen::VectorXd& intrinsics) -> Eigen::VectorXd {
          return Lens(camera.lens_model, std::vector<double>(intrinsics.begin(), intrinsics.end()))
              .project_point(ray->direction)
              .value();
        },
        Eigen::Map<const Eigen::VectorXd>(camera.intrinsics.data(), 12), 1e-4);
    squares += jacobian.colwise().squaredNorm().transpose() / 512;
  }
  for (Eigen::Index i = 0; i < 12; ++i) {
    EXPECT_NEAR(found(i, i) * squares[i] / 0.25, 1, 1e-5) << i;
  }
  EXPECT_TRUE(found.isDiagonal(0));
}

/// Image of zero width at the principal point: fx displaces no pixel.
TEST(MakeIntrinsicsCovariance, ReturnsZeroForIntrinsicThatDisplacesNoPixel) {
  const Camera camera{"", {0, 600}, LensModel::pinhole, {500, 400, -0.5, 299.5}, {}, {}, {}};
  const MatrixX found = make_intrinsics_covariance(camera, 3);
  ASSERT_EQ(found.rows(), 4);
  EXPECT_EQ(found(0, 0), 0);
  EXPECT_NEAR(found(2, 2), 18, 1e-9);
}

}  // namespace
}  // namespace vlp
