// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares each field of the result of run_bundle_adjustment() with an AdjustmentProblem that is
/// assembled and solved here.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "calibration/adjustment/adjustment_problem.h"
#include "calibration/adjustment/adjustment_room.h"
#include "calibration/adjustment/survey.h"
#include "camera/lens.h"
#include "geometry/statistical_bounds.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class RunBundleAdjustmentResult : public AdjustmentRoom {};

double compute_max_sd(const Eigen::Matrix2d& covariance) {
  const double mean = covariance.trace() / 2;
  return std::sqrt(mean + std::sqrt(mean * mean - covariance.determinant()));
}

TEST_F(RunBundleAdjustmentResult, EstimatesAndCovariancesMatchProblem) {
  AdjustmentProblem problem = make_problem(0.05, 0.03);
  const auto covariance = solve_with_noise(problem, 1);
  ASSERT_EQ(problem.noise_scale, 1);
  const AdjustmentLayout& at = problem.state_vector_layout();
  const Eigen::VectorXd& state = problem.state_vector();
  const Eigen::MatrixXd from_state = parameters_from_state(problem);
  const Eigen::MatrixXd expected = from_state * covariance.matrix * from_state.transpose();
  for (const bool is_checked : {true, false}) {
    input.captures_are_checked = is_checked;
    const AdjustmentResult found = run_bundle_adjustment(input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    const double stopped = is_checked ? 1e-5 : 1e-4;  // standard deviations

    EXPECT_THAT(found.covariance_lamp_ids, testing::ElementsAre(11, 12, 13, 14, 15));
    ASSERT_EQ(found.refined_covariance.rows(), 31);
    const Eigen::VectorXd sd = expected.diagonal().cwiseSqrt();
    for (Eigen::Index i = 0; i < 31; ++i) {
      for (Eigen::Index j = 0; j < 31; ++j) {
        EXPECT_NEAR(found.refined_covariance(i, j), expected(i, j), 1e-4 * sd[i] * sd[j] + 1e-16);
      }
    }
    EXPECT_EQ(found.refined_covariance, found.refined_covariance.transpose());

    const std::vector<double> intrinsics = problem.current_intrinsics();
    ASSERT_EQ(found.camera.intrinsics.size(), 12U);
    for (std::size_t i = 0; i < 12; ++i) {
      EXPECT_NEAR(found.camera.intrinsics[i], intrinsics[i],
                  1e-12 + stopped * sd[static_cast<Eigen::Index>(i)]);
    }
    EXPECT_EQ(found.center.model, RotationModel::tilt);
    const Eigen::Vector2d zenith = state.segment<2>(at.zenith);
    EXPECT_NEAR(found.center.zenith_in_camera.norm(), 1, 1e-15);
    EXPECT_THAT(found.center.zenith_in_camera.hnormalized(),
                IsNear(zenith, stopped * sd.segment<2>(12).maxCoeff()));
    EXPECT_NEAR(found.center.center_px.x(), intrinsics[2] + intrinsics[0] * zenith.x(), 1e-3);
    EXPECT_NEAR(found.center.center_px.y(), intrinsics[3] + intrinsics[1] * zenith.y(), 1e-3);
    ASSERT_TRUE(found.center.lever_arm_m);
    EXPECT_THAT(*found.center.lever_arm_m,
                IsNear(state.segment<2>(at.lever_arm), stopped * sd.segment<2>(14).maxCoeff()));
    EXPECT_EQ(found.center_covariance(), (found.refined_covariance.block<4, 4>(12, 12)));
  }
}

TEST_F(RunBundleAdjustmentResult, CountsAndResidualMatchProblem) {
  AdjustmentProblem problem = make_problem(0.05, 0.03);
  const auto covariance = solve_with_noise(problem, 1);
  input.captures[5].detections.insert(input.captures[5].detections.begin(),
                                      {99, {400, 300}, 0.05});     // not in the map
  input.captures[5].detections.push_back({12, {400, 300}, 0.05});  // the second one of lamp 12
  AdjustmentCapture dark{"dark", {input.captures[0].detections[0]}};
  input.captures.insert(input.captures.begin() + 1, dark);
  input.captures_are_checked = true;
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.captures, 13);
  EXPECT_EQ(found.rejected_captures, 1);
  EXPECT_EQ(found.detections, 64);
  EXPECT_EQ(found.rejected_detections, 0);
  EXPECT_EQ(found.noise_scale, 1);
  EXPECT_FALSE(found.noise_is_contradicted);
  const double expected_px = 0.05 * std::sqrt(sum_squares(problem) / covariance.degrees_of_freedom);
  EXPECT_NEAR(found.residual_px, expected_px, 1e-7);
}

TEST_F(RunBundleAdjustmentResult, LampsAndBothMapCovariancesMatchProblem) {
  AdjustmentProblem problem = make_problem(0.05, 0.03);
  solve_with_noise(problem, 1);
  const AdjustmentLayout& at = problem.state_vector_layout();
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.lamps.size(), 5U);
  ASSERT_EQ(found.refined_map.lamps.size(), kLamps);
  for (std::size_t i = 0; i < kLamps; ++i) {
    const Lamp& surveyed = input.lamps.lamps[i];
    const Lamp& refined = found.refined_map.lamps[i];
    EXPECT_EQ(refined.id, surveyed.id);
    const bool is_detected = i < 5;
    Eigen::Matrix3d covariance;
    if (is_detected) {
      const Eigen::Index row = 16 + 3 * static_cast<Eigen::Index>(i);
      covariance = found.refined_covariance.block<3, 3>(row, row);
      EXPECT_THAT(found.surveyed_covariance.middleRows<3>(row).rightCols(15),
                  IsNear((Eigen::MatrixXd(3, 15) << Eigen::MatrixXd::Zero(3, row - 16),
                          *surveyed.sd_m * *surveyed.sd_m * Eigen::Matrix3d::Identity(),
                          Eigen::MatrixXd::Zero(3, 28 - row))
                             .finished(),
                         1e-18));
      const auto& corrected = found.lamps[i];
      EXPECT_EQ(corrected.id, surveyed.id);
      EXPECT_FALSE(corrected.is_moved);
      EXPECT_THAT(
          corrected.correction_m,
          IsNear(problem.state_vector().segment<3>(at.lamp_state_index(i)) - surveyed.position_m,
                 1e-8));
      EXPECT_THAT(corrected.sd_m, IsNear(covariance.diagonal().cwiseSqrt(), 1e-15));
    }
    if (i == 1 || !is_detected) {
      EXPECT_EQ(refined.position_m, surveyed.position_m) << "exact, or not in view";
      EXPECT_EQ(refined.sd_m, surveyed.sd_m);
      continue;
    }
    EXPECT_THAT(refined.position_m,
                IsNear(surveyed.position_m + found.lamps[i].correction_m, 1e-15));
    EXPECT_GT(found.lamps[i].correction_m.norm(), 1e-4);
    ASSERT_TRUE(refined.sd_m);
    EXPECT_NEAR(*refined.sd_m, std::sqrt(covariance.diagonal().mean()), 1e-12);
  }
  EXPECT_EQ(found.surveyed_covariance.topRows<16>(), found.refined_covariance.topRows<16>());
  EXPECT_EQ(found.surveyed_covariance.leftCols<16>(), found.refined_covariance.leftCols<16>());
  EXPECT_THAT(found.notes, testing::ElementsAre("lamp 16 is visible in no capture: its position "
                                                "stays unchanged"));
}

TEST_F(RunBundleAdjustmentResult, LampsWithoutDetectionAreNoUnknowns) {
  make_problem(0.05, 0.03);
  const AdjustmentResult few = run_bundle_adjustment(input);
  ASSERT_TRUE(few.has_succeeded()) << few.undetermined;
  constexpr int num_more = 3000;
  for (int i = 0; i < num_more; ++i)
    input.lamps.lamps.push_back({1000 + i, {20. + i, 5, 3}, {}, {}, {}, 0.002});
  const AdjustmentResult many = run_bundle_adjustment(input);
  ASSERT_TRUE(many.has_succeeded()) << many.undetermined;
  EXPECT_EQ(many.covariance_lamp_ids, few.covariance_lamp_ids);
  EXPECT_EQ(many.refined_covariance, few.refined_covariance);
  EXPECT_EQ(many.refined_map.lamps.size(), input.lamps.lamps.size());
  EXPECT_THAT(many.notes, testing::ElementsAre("3001 lamps, such as 16, are visible in no capture: "
                                               "their positions stay unchanged"));
}

TEST_F(RunBundleAdjustmentResult, KnownPositionsListResidualsOfEachPivotAndPosition) {
  AdjustmentProblem problem = make_problem(0.05, 0.03);
  solve_with_noise(problem, 1);
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  const std::vector<std::string> names{"b",       "a",       "fifth",     "other x",
                                       "other y", "other z", "no height", "axis"};
  const std::vector<int> captures{2, 2, 2, 1, 1, 1, 1, 1};
  ASSERT_EQ(found.known_positions.size(), names.size());
  std::vector<Eigen::Vector3d> residuals_m(names.size(), Eigen::Vector3d::Zero());
  for (const auto& place : problem.position_observations) {
    const Eigen::Vector3d residual_m =
        problem.predict_camera_or_axis_position(place) - place.measured_m;
    residuals_m[place.known_position].head(place.size) +=
        residual_m.head(place.size) / captures[place.known_position];
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto& place = found.known_positions[i];
    EXPECT_EQ(place.name, names[i]);
    EXPECT_EQ(place.captures, captures[i]) << names[i];
    EXPECT_EQ(place.measured_point, i == 0 || i == 7 ? MeasuredPoint::axis : MeasuredPoint::camera)
        << names[i];
    EXPECT_FALSE(place.is_outlier) << names[i];
    EXPECT_GT(residuals_m[i].norm(), 1e-4);
    EXPECT_THAT(place.residual_m, IsNear(residuals_m[i], 1e-7)) << names[i];
  }
  EXPECT_EQ(found.known_positions[1].residual_m.z(), 0);
  EXPECT_EQ(found.known_positions[6].residual_m.z(), 0);
}

/// Errors of the focal lengths for which chi-squared is 1, and 3 % below and above its bound.
TEST_F(RunBundleAdjustmentResult, LensChiSquaredComparesCorrectionWithItsCovariance) {
  const AdjustmentProblem truth = make_problem(0.05, 0.03);
  const double bound = compute_chi_squared_bound(kSigmasOfOneInTenThousand, 3);
  input.captures_are_checked = true;
  double error_px = 1, expected_at_1_px = 0;
  for (const double fraction : {0.0, 0.97, 1.03}) {
    if (fraction > 0) error_px = std::sqrt(fraction * bound / expected_at_1_px);
    Camera& camera = input.calibration.camera;
    camera.intrinsics[0] = 520 + error_px;
    camera.intrinsics[1] = 522 - error_px;
    const LensParametrization lens(camera, input.calibration.intrinsics_report->covariance);
    AdjustmentProblem problem(camera.lens_model, lens, kLamps, 2);
    problem.captures = truth.captures;
    problem.sightings = truth.sightings;
    problem.lamps = truth.lamps;
    problem.position_observations = truth.position_observations;
    problem.is_known_position_used = truth.is_known_position_used;
    problem.has_lever_arm = true;
    problem.state_vector() = truth.state_vector();
    const auto covariance = solve_with_noise(problem, 1);
    const Eigen::Vector3d u = problem.state_vector().head<3>();
    const Eigen::Matrix3d determined =
        Eigen::Matrix3d::Identity() - covariance.matrix.topLeftCorner(3, 3);
    const double expected = u.dot(determined.inverse() * u);
    if (fraction == 0) expected_at_1_px = expected;
    const AdjustmentResult found = run_bundle_adjustment(input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    ASSERT_EQ(found.rejected_detections, 0);
    EXPECT_EQ(found.lens_degrees_of_freedom, 3);
    EXPECT_NEAR(found.lens_chi_squared, expected, 1e-3 * expected);
    if (fraction > 0) EXPECT_NEAR(found.lens_chi_squared / bound, fraction, 0.02);
    EXPECT_EQ(found.lens_is_contradicted, fraction > 1);
  }
}

/// The captures determine a focal length, but no coefficient that is known to 1e-9.
TEST_F(RunBundleAdjustmentResult, LensDegreesOfFreedomCountOnlyDeterminedDirections) {
  make_problem(0.05, 0.03);
  for (const double focal_sd_px : {2.0, 0.0}) {
    MatrixX covariance = MatrixX::Zero(12, 12);
    covariance(0, 0) = focal_sd_px * focal_sd_px;
    covariance(11, 11) = 1e-18;
    input.calibration.intrinsics_report->covariance = covariance;
    const AdjustmentResult found = run_bundle_adjustment(input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    EXPECT_EQ(found.lens_degrees_of_freedom, focal_sd_px > 0 ? 1 : 0);
    EXPECT_EQ(found.lens_chi_squared > 0, focal_sd_px > 0);
    EXPECT_FALSE(found.lens_is_contradicted);
  }
  input.calibration.intrinsics_report->covariance = MatrixX::Zero(12, 12);
  (*input.calibration.intrinsics_report->covariance)(1, 1) = 4;
  const AdjustmentResult one_error = run_bundle_adjustment(input);
  ASSERT_TRUE(one_error.has_succeeded()) << one_error.undetermined;
  EXPECT_EQ(one_error.lens_degrees_of_freedom, 1);
  // The determined variance of fy is the difference between its variances before and after.
  const double correction_px = one_error.camera.intrinsics[1] - 522;
  EXPECT_GT(std::abs(correction_px), 0);
  const double expected = correction_px * correction_px / (4 - one_error.refined_covariance(1, 1));
  EXPECT_NEAR(one_error.lens_chi_squared, expected, 1e-9 * expected);
  input.calibration.intrinsics_report.reset();
  const AdjustmentResult exact_lens = run_bundle_adjustment(input);
  ASSERT_TRUE(exact_lens.has_succeeded()) << exact_lens.undetermined;
  EXPECT_EQ(exact_lens.lens_degrees_of_freedom, 0);
  EXPECT_EQ(exact_lens.camera.intrinsics, input.calibration.camera.intrinsics);
}

TEST_F(RunBundleAdjustmentResult, NoiseScaleAndContradictionMatchResidualsForTooSmallSigma) {
  AdjustmentProblem problem = make_problem(0.005, 0.03);
  const auto covariance = solve_with_noise(problem, 1);
  ASSERT_GT(problem.noise_scale, 3);
  input.captures_are_checked = true;
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.rejected_detections, 0);
  EXPECT_NEAR(found.noise_scale, problem.noise_scale, 1e-6 * problem.noise_scale);
  EXPECT_TRUE(found.noise_is_contradicted);
  EXPECT_NEAR(
      found.residual_px,
      0.005 * problem.noise_scale * std::sqrt(sum_squares(problem) / covariance.degrees_of_freedom),
      1e-7);
  const Eigen::Matrix4d zenith_and_arm = covariance.matrix.block(3, 3, 4, 4);
  EXPECT_THAT(found.refined_covariance.block(12, 12, 4, 4), IsNear(zenith_and_arm, 1e-12));
  // Sigmas for which the noise scale is 3 % above and below the limit of the contradiction.
  const double limit = 1 + 3 * std::sqrt(0.5 / covariance.degrees_of_freedom);
  for (const double factor : {0.97, 1.03}) {
    make_problem(0.005 * problem.noise_scale / (limit * factor), 0.03);
    const AdjustmentResult near_limit = run_bundle_adjustment(input);
    ASSERT_TRUE(near_limit.has_succeeded());
    EXPECT_NEAR(near_limit.noise_scale / limit, factor, 0.02);
    EXPECT_EQ(near_limit.noise_is_contradicted, factor > 1) << factor;
  }
}

TEST_F(RunBundleAdjustmentResult, NoiseScaleIsResidualWithoutGivenSigma) {
  AdjustmentProblem problem = make_problem(1, 0.03);
  const auto covariance = solve_with_noise(problem, 0);
  // One detection without sigma is enough; the others have the sigma of the assumption.
  input.captures[1].detections[2].sigma_px.reset();
  input.captures_are_checked = true;
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.rejected_detections, 0);
  EXPECT_LT(found.noise_scale, 0.03);
  EXPECT_NEAR(found.noise_scale, problem.noise_scale, 1e-6 * problem.noise_scale);
  EXPECT_FALSE(found.noise_is_contradicted);
  EXPECT_NEAR(found.residual_px,
              problem.noise_scale * std::sqrt(sum_squares(problem) / covariance.degrees_of_freedom),
              1e-7);
}

/// Estimates with equal weights in the undistorted image have the covariance of equal noise in the
/// distorted one.
TEST_F(RunBundleAdjustmentResult, WeightsInUndistortedImageChangeEstimatesButNotCovariance) {
  AdjustmentProblem problem = make_problem(1, 0.03);
  const Lens lens(input.calibration.camera.lens_model, input.calibration.camera.intrinsics);
  // Only captures 0 and 7 have given sigmas.
  for (std::size_t k = 0; k < input.captures.size(); ++k) {
    for (Detection& detection : input.captures[k].detections) {
      detection.sigma_px.reset();
      if (k % 7 == 0) detection.sigma_px = 0.8;
    }
  }
  const auto undistort = [&](const Eigen::Vector2d& pixel) -> Eigen::Vector2d {
    return Eigen::Vector2d(520, 522).cwiseProduct(
        lens.unproject_pixel(pixel).value().direction.hnormalized());
  };
  for (auto& sighting : problem.sightings) {
    if (sighting.capture % 7 == 0) {
      sighting.sigma_px = 0.8;
      sighting.whitening = Eigen::Matrix2d::Identity() / 0.8;
      continue;
    }
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = 1e-3 * Eigen::Vector2d::Unit(axis);
      sighting.whitening.col(axis) =
          (undistort(sighting.pixel + step) - undistort(sighting.pixel - step)) / 2e-3;
    }
  }
  solve_with_noise(problem, 0);
  const Eigen::Vector2d zenith = problem.state_vector().segment<2>(3);
  for (auto& sighting : problem.sightings) {
    sighting.whitening = Eigen::Matrix2d::Identity() / sighting.sigma_px;
  }
  problem.noise_scale *= std::sqrt(sum_squares(problem) /
                                   problem.compute_global_unknowns_covariance().degrees_of_freedom);
  const auto covariance = problem.compute_global_unknowns_covariance();

  input.captures_are_checked = true;
  const AdjustmentResult equal = run_bundle_adjustment(input);
  input.weighs_in_undistorted_image = true;
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(equal.has_succeeded() && found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.rejected_detections, 0);
  const double sd = std::sqrt(covariance.matrix(3, 3));
  EXPECT_THAT(found.center.zenith_in_camera.hnormalized(), IsNear(zenith, 1e-3 * sd));
  EXPECT_GT((equal.center.zenith_in_camera.hnormalized() - zenith).norm(), 0.02 * sd);
  EXPECT_NEAR(found.noise_scale, problem.noise_scale, 1e-5 * problem.noise_scale);
  const Eigen::Matrix4d zenith_and_arm = covariance.matrix.block(3, 3, 4, 4);
  EXPECT_THAT(found.refined_covariance.block(12, 12, 4, 4), IsNear(zenith_and_arm, 1e-5 * sd * sd));
}

TEST_F(RunBundleAdjustmentResult, LimitsOfZenithAndLeverArmApplyToLargestSd) {
  AdjustmentProblem problem = make_problem(0.05, 0.03);
  solve_with_noise(problem, 1);
  double height_m = 0;
  for (const auto& sighting : problem.sightings) {
    const Eigen::Index lamp = 7 + 3 * static_cast<Eigen::Index>(sighting.lamp);
    const auto& capture = problem.captures[sighting.capture];
    Eigen::Index position = capture.local;
    if (capture.pivot) position = 25 + 3 * static_cast<Eigen::Index>(*capture.pivot);
    height_m += problem.state_vector()[lamp + 2] - problem.state_vector()[position + 2];
  }
  height_m /= static_cast<double>(problem.sightings.size());
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_TRUE(found.center.lever_arm_m);
  const double zenith_sd = compute_max_sd(found.refined_covariance.block(12, 12, 2, 2));
  const double arm_fraction =
      compute_max_sd(found.refined_covariance.block(14, 14, 2, 2)) / height_m;
  constexpr double less = 1 - 1e-5, more = 1 + 1e-5;

  EXPECT_EQ(run_bundle_adjustment(input, {zenith_sd * more, 1}).undetermined, "");
  EXPECT_EQ(run_bundle_adjustment(input, {zenith_sd * less, 1}).undetermined,
            "the captures do not determine the tilt: add a rotation in place over 90 degrees or "
            "more, or captures with more lamps at other yaws");
  EXPECT_EQ(
      run_bundle_adjustment(input, {zenith_sd * less, arm_fraction * less}).undetermined,
      "tilt and lever arm cannot be separated; add a rotation in place at a second height, or "
      "captures at known camera positions and several yaws");
  EXPECT_TRUE(run_bundle_adjustment(input, {1, arm_fraction * more}).center.lever_arm_m);
  const AdjustmentResult without_arm = run_bundle_adjustment(input, {1, arm_fraction * less});
  ASSERT_TRUE(without_arm.has_succeeded());
  EXPECT_FALSE(without_arm.center.lever_arm_m);
  EXPECT_EQ(without_arm.center_covariance().rows(), 2);
  ASSERT_EQ(without_arm.refined_covariance.rows(), 31);
  Eigen::MatrixXd expected = found.refined_covariance;
  expected.middleRows<2>(14).setZero();
  expected.middleCols<2>(14).setZero();
  EXPECT_THAT(without_arm.refined_covariance, IsNear(expected, 1e-15));
  EXPECT_EQ(without_arm.center.zenith_in_camera, found.center.zenith_in_camera);
}

/// Neither a pivot nor the position of the axis.
TEST_F(RunBundleAdjustmentResult, HasNoLeverArmWithoutDataOfTheAxis) {
  make_problem(0.05, 0.03);
  for (AdjustmentCapture& capture : input.captures) {
    capture.pivot.clear();
    if (capture.name == "axis" || capture.name[0] == 'b') capture.known_position.reset();
  }
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_FALSE(found.center.lever_arm_m);
  EXPECT_THAT(run_bundle_adjustment(input, {1e-9, 1e9}).undetermined,
              HasSubstr("do not determine the tilt"));
}

/// Derivatives by differences, over the centers of 16 x 16 equal parts of the image.
TEST(ComputeIntrinsicsCovarianceFromPixelSd, ReturnsVariancesOfEqualImageDisplacement) {
  const Camera camera = synthetic_camera();
  const Lens lens(camera.lens_model, camera.intrinsics);
  const MatrixX found = compute_intrinsics_covariance_from_pixel_sd(camera, 0.5);
  ASSERT_EQ(found.rows(), 12);
  ASSERT_EQ(found.cols(), 12);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(12);
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 16; ++column) {
      const auto ray = lens.unproject_pixel({50 * column + 24.5, 37.5 * row + 18.25});
      ASSERT_TRUE(ray);
      for (std::size_t i = 0; i < 12; ++i) {
        std::vector<double> less = camera.intrinsics, more = camera.intrinsics;
        less[i] -= 1e-4;
        more[i] += 1e-4;
        const Eigen::Vector2d difference =
            Lens(camera.lens_model, more).project_point(ray->direction).value() -
            Lens(camera.lens_model, less).project_point(ray->direction).value();
        squares[static_cast<Eigen::Index>(i)] += (difference / 2e-4).squaredNorm() / 512;
      }
    }
  }
  for (Eigen::Index i = 0; i < 12; ++i) {
    EXPECT_NEAR(found(i, i) * squares[i] / 0.25, 1, 1e-5) << i;
  }
  EXPECT_TRUE(found.isDiagonal(0));
}

/// The noise scale changes from 1 if the residuals differ by more than 1 %.
TEST_F(RunBundleAdjustmentResult, NoiseScaleIsKeptIfResidualsDifferByOnePercentAtMost) {
  input.captures_are_checked = true;
  double sigma_px = 0.02;
  for (const double ratio : {1.009, 1.012}) {
    for (int iteration = 0; iteration < 6; ++iteration) {
      AdjustmentProblem problem = make_problem(sigma_px, 0.03);
      ASSERT_TRUE(problem.solve_adjustment(false));
      sigma_px *= std::sqrt(sum_squares(problem) /
                            problem.compute_global_unknowns_covariance().degrees_of_freedom) /
                  ratio;
    }
    make_problem(sigma_px, 0.03);
    const AdjustmentResult found = run_bundle_adjustment(input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    ASSERT_EQ(found.rejected_detections, 0);
    if (ratio < 1.01) EXPECT_EQ(found.noise_scale, 1);
    if (ratio > 1.01) EXPECT_NEAR(found.noise_scale, ratio, 1e-5);
    EXPECT_NEAR(found.residual_px / sigma_px, ratio, 1e-4);
    EXPECT_FALSE(found.noise_is_contradicted);
  }
}

TEST_F(RunBundleAdjustmentResult, WeightsInUndistortedImageHaveNoEffectOnGivenSigmas) {
  make_problem(0.05, 0.03);
  const AdjustmentResult equal = run_bundle_adjustment(input);
  input.weighs_in_undistorted_image = true;
  const AdjustmentResult found = run_bundle_adjustment(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.noise_scale, 1);
  EXPECT_EQ(found.center.zenith_in_camera, equal.center.zenith_in_camera);
  EXPECT_EQ(found.refined_covariance, equal.refined_covariance);
  EXPECT_EQ(found.residual_px, equal.residual_px);
}

TEST_F(RunBundleAdjustmentResult, NoiseOfExactDetectionsInUndistortedImageIsTheSmallest) {
  Survey survey(0);
  survey.turn({0, 0, 0}, 4);
  survey.turn({0.3, 0.1, 0.2}, 4);
  for (AdjustmentCapture& capture : survey.input.captures) {
    for (Detection& detection : capture.detections) detection.sigma_px.reset();
  }
  survey.input.weighs_in_undistorted_image = true;
  const AdjustmentResult found = run_bundle_adjustment(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.rejected_detections, 0);
  EXPECT_EQ(found.noise_scale, 1e-4);
  EXPECT_LT(found.residual_px, 1e-8);
}

/// Two lamps from a known position: four rows for tilt and yaw, and little more for the position.
/// Variances are divided by one degree of freedom at least.
TEST_F(RunBundleAdjustmentResult, NoiseOfLessThanOneDegreeOfFreedomIsSumOfSquares) {
  const Camera camera{"", {800, 600}, LensModel::pinhole, {500, 400, 399.5, 299.5}, {}, {}, {}};
  const Eigen::Vector3d camera_m(0.1, -0.2, 0.3);
  const std::vector<Eigen::Vector3d> lamps_m{{-0.5, -0.3, 2.1}, {0.7, 0.2, 2.3}};
  for (const double error_px : {4.6, 5.4}) {
    AdjustmentInput two_lamps;
    two_lamps.calibration.camera = camera;
    two_lamps.lamps = make_lamp_map(lamps_m);
    for (Lamp& lamp : two_lamps.lamps.lamps) lamp.sd_m = 0;
    AdjustmentProblem problem(camera.lens_model, LensParametrization(camera, std::nullopt), 2, 0);
    const AdjustmentLayout& at = problem.state_vector_layout();
    problem.add_capture_with_initial_pose({{}, Eigen::Matrix3d::Identity()}, {camera_m, 0.4});
    problem.is_known_position_used = {true};
    problem.position_observations = {{0, 0, false, camera_m, 3, 1.5e-2}};
    AdjustmentCapture capture{"known", {}};
    capture.known_position =
        KnownPosition{MeasuredPoint::camera, camera_m.head<2>(), camera_m.z(), 1.5e-2};
    const Lens lens(camera.lens_model, camera.intrinsics);
    // The direction from one lamp to the other in the image.
    const Eigen::Vector2d apart =
        (rotation_about_z(-0.4) * Eigen::Vector3d(600 / 1.8, 200 / 2.0, 0)).head<2>().normalized();
    for (std::size_t i = 0; i < 2; ++i) {
      problem.state_vector().segment<3>(at.lamp_state_index(i)) = lamps_m[i];
      problem.lamps.push_back({lamps_m[i], 0});
      AdjustmentProblem::Sighting sighting{0, i, {0, 0}, 2, Eigen::Matrix2d::Identity() / 2, 0};
      const auto predicted = problem.linearize_lamp_observation(sighting, lens);
      ASSERT_TRUE(predicted);
      sighting.pixel = -2 * predicted->value;
      sighting.pixel += (i == 0 ? -error_px : error_px) * apart;
      problem.sightings.push_back(sighting);
      capture.detections.push_back({static_cast<int>(i) + 1, sighting.pixel, 2});
    }
    two_lamps.captures = {capture};
    two_lamps.captures_are_checked = true;
    double freedom = 0, ratio = 2;
    for (int iteration = 0; iteration < 20 && std::abs(ratio - 1) > 0.01; ++iteration) {
      ASSERT_TRUE(problem.solve_adjustment(false));
      freedom = problem.compute_global_unknowns_covariance().degrees_of_freedom;
      ratio = std::sqrt(sum_squares(problem));
      if (std::abs(ratio - 1) > 0.01) problem.noise_scale *= ratio;
    }
    ASSERT_GT(problem.noise_scale, 2.8);
    ASSERT_LT(problem.noise_scale, 3.6);
    ASSERT_GT(freedom, 0.1);
    ASSERT_LT(freedom, 0.99);
    const AdjustmentResult found = run_bundle_adjustment(two_lamps);
    ASSERT_EQ(found.detections, 2);
    ASSERT_EQ(found.captures, 1);
    EXPECT_NEAR(found.noise_scale, problem.noise_scale, 1e-6);
    EXPECT_NEAR(found.residual_px, 2 * problem.noise_scale * ratio, 1e-6);
    EXPECT_EQ(found.noise_is_contradicted, problem.noise_scale > 1 + 3 * std::sqrt(0.5));
    EXPECT_EQ(found.noise_is_contradicted, error_px > 5);
  }
}

/// Image of zero width at the principal point: fx displaces no pixel.
TEST(ComputeIntrinsicsCovarianceFromPixelSd, ReturnsZeroForIntrinsicThatDisplacesNoPixel) {
  const Camera camera{"", {0, 600}, LensModel::pinhole, {500, 400, -0.5, 299.5}, {}, {}, {}};
  const MatrixX found = compute_intrinsics_covariance_from_pixel_sd(camera, 3);
  ASSERT_EQ(found.rows(), 4);
  EXPECT_EQ(found(0, 0), 0);
  // (v - cy) / fy has the mean square (600^2 - 37.5^2) / 12 / 400^2; one axis has half of it.
  EXPECT_NEAR(found(1, 1), 9 * 2 * 12 * 160000 / (360000 - 37.5 * 37.5), 1e-9);
  EXPECT_NEAR(found(2, 2), 18, 1e-9);
  EXPECT_NEAR(found(3, 3), 18, 1e-9);
}

}  // namespace
}  // namespace vlp
