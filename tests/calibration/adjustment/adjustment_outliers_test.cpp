// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Outliers among detections, surveyed lamps and known positions of adjust_bundle(), at
/// their limits.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "calibration/adjustment/adjustment_room.h"
#include "calibration/adjustment/survey.h"
#include "camera/lens.h"
#include "geometry/robust_scatter.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

/// Chi-squared with three degrees of freedom beyond which a lamp counts as moved.
constexpr double kMovedLimit = 21.1;

std::vector<int> list_moved_lamps(const AdjustmentResult& result) {
  std::vector<int> ids;
  for (const auto& lamp : result.lamps) {
    if (lamp.is_moved) ids.push_back(lamp.id);
  }
  return ids;
}

std::vector<std::string> list_wrong_positions(const AdjustmentResult& result) {
  std::vector<std::string> names;
  for (const auto& place : result.known_positions) {
    if (place.is_outlier) names.push_back(place.name);
  }
  return names;
}

class AdjustBundleOutliers : public AdjustmentRoom {
 protected:
  /// Returns chi-squared of a lamp's survey in the least-squares solution that uses it.
  double compute_survey_chi_squared(std::size_t lamp) const {
    const Solution solution = solve(1);
    EXPECT_EQ(solution.noise_scale, 1);
    const Eigen::Index at = 16 + 3 * static_cast<Eigen::Index>(lamp);
    const Lamp& surveyed = input.lamps.lamps[lamp];
    const Eigen::Vector3d r_m = solution.parameters.segment<3>(at) - surveyed.position_m;
    const Eigen::Matrix3d covariance =
        *surveyed.sd_m * *surveyed.sd_m * Eigen::Matrix3d::Identity() -
        solution.covariance.block<3, 3>(at, at);
    return r_m.dot(covariance.inverse() * r_m);
  }
};

/// The survey of the lamp is as uncertain as its position from the captures.
TEST_F(AdjustBundleOutliers, LampIsReportedAsMovedAboveChiSquaredLimit) {
  constexpr std::size_t lamp = 2;
  input.captures_are_checked = true;
  scale_survey(0.1);
  const Eigen::Vector3d direction(0.6, -0.7, 0.4);
  double offset_m = 1e-3, chi_squared = 0;
  const auto move_lamp = [&] {
    input.lamps.lamps[lamp].position_m = true_lamps_m[lamp] + offset_m * direction;
    measure(0.2, 0.05);
    chi_squared = compute_survey_chi_squared(lamp);
  };
  for (const double fraction : {0.98, 1.02}) {
    for (int iteration = 0; iteration < 2; ++iteration) {
      move_lamp();
      offset_m *= std::sqrt(fraction * kMovedLimit / chi_squared);
    }
    move_lamp();
    ASSERT_NEAR(chi_squared / kMovedLimit, fraction, 1e-3);
    const AdjustmentResult found = adjust_bundle(input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    ASSERT_EQ(found.rejected_detections, 0);
    ASSERT_EQ(found.noise_scale, 1);
    if (fraction < 1) {
      EXPECT_THAT(list_moved_lamps(found), testing::IsEmpty());
      continue;
    }
    EXPECT_EQ(list_moved_lamps(found), std::vector<int>{13});
    // The surveyed position of a moved lamp has its own error only.
    const Eigen::Index row = 16 + 3 * static_cast<Eigen::Index>(lamp);
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(3, 31);
    const double sd_m = *input.lamps.lamps[lamp].sd_m;
    expected.middleCols(row, 3) = sd_m * sd_m * Eigen::Matrix3d::Identity();
    EXPECT_THAT(found.surveyed_covariance.middleRows(row, 3), IsNear(expected, 1e-18));
    EXPECT_THAT(found.surveyed_covariance.middleCols(row, 3).transpose(), IsNear(expected, 1e-18));
    EXPECT_GT(found.refined_covariance.block(row, 0, 3, 4).cwiseAbs().maxCoeff(), 1e-8);
  }
}

/// A noise of 0.03 px moves lamps away from their survey if sigma is 0.005 px, and does not if
/// sigma increases to the noise.
TEST_F(AdjustBundleOutliers, LampsAreNotReportedAsMovedIfNoiseExplainsThem) {
  scale_survey(0.02);
  measure(0.005, 0.03);
  const Solution expected = solve(1);
  for (const bool is_checked : {true, false}) {
    input.captures_are_checked = is_checked;
    const AdjustmentResult found = adjust_bundle(input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    EXPECT_THAT(list_moved_lamps(found), testing::IsEmpty());
    ASSERT_EQ(found.rejected_detections, 0);
    EXPECT_NEAR(found.noise_scale / expected.noise_scale, 1, 0.02);
    EXPECT_LT(*found.refined_map.lamps[0].sd_m, *input.lamps.lamps[0].sd_m);
  }
}

/// With two wrong lamps among five, the three others agree with the survey. With two among four,
/// the survey is contradicted, and no lamp is moved.
TEST_F(AdjustBundleOutliers, LampsAreReportedAsMovedOnlyIfMajorityAgreesWithSurvey) {
  scale_survey(0.3);
  input.captures_are_checked = true;
  input.lamps.lamps[0].position_m = true_lamps_m[0] + Eigen::Vector3d(0.02, -0.01, 0.01);
  input.lamps.lamps[3].position_m = true_lamps_m[3] + Eigen::Vector3d(-0.01, -0.02, 0);
  measure(0.05, 0.03);
  const AdjustmentResult of_five = adjust_bundle(input);
  ASSERT_TRUE(of_five.has_succeeded()) << of_five.undetermined;
  EXPECT_THAT(list_moved_lamps(of_five), testing::ElementsAre(11, 14));
  EXPECT_THAT(of_five.notes, testing::SizeIs(1)) << "lamp in no capture";
  ASSERT_EQ(of_five.lamps.size(), 5U);
  EXPECT_THAT(of_five.lamps[0].correction_m, IsNear(Eigen::Vector3d(-0.02, 0.01, -0.01), 2e-3));
  EXPECT_THAT(of_five.lamps[3].correction_m, IsNear(Eigen::Vector3d(0.01, 0.02, 0), 2e-3));

  for (AdjustmentCapture& capture : input.captures) capture.detections.pop_back();
  const AdjustmentResult of_four = adjust_bundle(input);
  ASSERT_TRUE(of_four.has_succeeded()) << of_four.undetermined;
  ASSERT_EQ(of_four.lamps.size(), 4U);
  EXPECT_THAT(list_moved_lamps(of_four), testing::IsEmpty());
  EXPECT_THAT(of_four.notes,
              testing::Contains("the captures contradict the survey of half the lamps or more: is "
                                "its sd_m right?"));
  EXPECT_LT(*of_four.refined_map.lamps[0].sd_m, *input.lamps.lamps[0].sd_m) << "survey is used";
}

/// Lamps that are farther than 8 standard deviations from the robust solution are moved, even half
/// of them.
TEST_F(AdjustBundleOutliers, LampsBeyondEightSdsAreReportedAsMovedEvenIfHalf) {
  scale_survey(0.3);
  for (AdjustmentCapture& capture : input.captures) {
    if (capture.known_position) capture.known_position->sd_m *= 0.1;
  }
  for (const double sigmas : {7.4, 8.6}) {
    for (const std::size_t lamp : {0U, 3U}) {
      Lamp& surveyed = input.lamps.lamps[lamp];
      surveyed.position_m =
          true_lamps_m[lamp] +
          sigmas * *surveyed.sd_m * Eigen::Vector3d(0.8, lamp == 0 ? 0.6 : -0.6, 0);
    }
    measure(0.02, 0.01);
    for (AdjustmentCapture& capture : input.captures) capture.detections.pop_back();
    const AdjustmentResult found = adjust_bundle(input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    ASSERT_EQ(found.rejected_detections, 0) << sigmas;
    EXPECT_THAT(list_moved_lamps(found), testing::SizeIs(sigmas > 8 ? 2 : 0)) << sigmas;
  }
}

/// The robust solution rejects the detections of the lamp instead of its position.
TEST_F(AdjustBundleOutliers, DetectionsOfMisplacedExactLampAreRejected) {
  input.lamps.lamps[1].position_m.x() += 0.2;
  measure(0.05, 0.03);
  const AdjustmentResult found = adjust_bundle(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.rejected_detections, 13);
  EXPECT_EQ(found.detections, 51);
  EXPECT_THAT(list_moved_lamps(found), testing::IsEmpty());
  EXPECT_EQ(found.refined_map.lamps[1].position_m, input.lamps.lamps[1].position_m);
}

/// A position that seems wrong beside a lamp that has moved by 8 cm.
TEST_F(AdjustBundleOutliers, KnownPositionIsReinstatedOnceMovedLampIsFound) {
  input.captures_are_checked = true;
  measure(0.0005, 0.03);
  input.lamps.lamps[0].position_m.x() += 0.08;
  const AdjustmentResult found = adjust_bundle(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(list_moved_lamps(found), std::vector<int>{11});
  EXPECT_THAT(list_wrong_positions(found), testing::IsEmpty());
}

/// A wrong position that is stated as very accurate dominates the plain solution, in which the
/// other positions seem wrong. The robust solution rejects it.
TEST_F(AdjustBundleOutliers, WrongPositionWithSmallSdIsRejectedInsteadOfOthers) {
  Survey survey(0.05);
  survey.five_places(1e-3);
  for (AdjustmentCapture& capture : survey.input.captures) {
    if (capture.pivot != "spot-24") continue;
    capture.known_position->sd_m = 2e-4;
    capture.known_position->xy_m.x() += 0.02;
  }
  const AdjustmentResult robust = adjust_bundle(survey.input);
  ASSERT_TRUE(robust.has_succeeded()) << robust.undetermined;
  EXPECT_THAT(list_wrong_positions(robust), testing::ElementsAre("spot-24"));
  survey.input.captures_are_checked = true;
  const AdjustmentResult plain = adjust_bundle(survey.input);
  ASSERT_TRUE(plain.has_succeeded()) << plain.undetermined;
  EXPECT_THAT(list_wrong_positions(plain), testing::Not(testing::ElementsAre("spot-24")));
}

/// Survey with an exact map, whose rotations determine each axis to 0.1 mm.
TEST_F(AdjustBundleOutliers, KnownPositionIsOutlierBeyondFiveSds) {
  constexpr double sd_m = 5e-3;
  for (const bool is_checked : {true, false}) {
    for (const auto& [low, high] :
         {std::pair(4.8, 5.2), std::pair(9.0, 6.0), std::pair(6.0, 9.0)}) {
      Survey survey(0);
      survey.turn({0, 0, 0}, 4, sd_m);
      survey.turn({0.3, 0.1, 0.2}, 4, sd_m);
      survey.turn({-0.3, 0.2, 0.1}, 4, sd_m);
      survey.input.captures_are_checked = is_checked;
      const double first_m = low * sd_m, second_m = high * sd_m;
      for (AdjustmentCapture& capture : survey.input.captures) {
        KnownPosition& place = *capture.known_position;
        if (capture.pivot == "spot-4") place.xy_m += first_m * Eigen::Vector2d(0.6, -0.8);
        if (capture.pivot == "spot-8") *place.z_m += second_m;
      }
      const AdjustmentResult found = adjust_bundle(survey.input);
      ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
      ASSERT_EQ(found.known_positions.size(), 3U);
      EXPECT_FALSE(found.known_positions[0].is_outlier);
      EXPECT_EQ(found.known_positions[1].is_outlier, low > 5) << is_checked;
      EXPECT_TRUE(found.known_positions[2].is_outlier) << is_checked;
      EXPECT_THAT(found.known_positions[2].residual_m,
                  IsNear(Eigen::Vector3d(0, 0, -second_m), 0.1 * sd_m));
      EXPECT_THAT(found.known_positions[1].residual_m,
                  IsNear(Eigen::Vector3d(-0.6 * first_m, 0.8 * first_m, 0), 0.1 * sd_m));
    }
  }
}

/// Exact detections but one: the limit is 4.5 given standard deviations.
TEST_F(AdjustBundleOutliers, DetectionIsOutlierBeyondFourAndAHalfSigmas) {
  for (const bool is_checked : {true, false}) {
    for (const double sigmas : {4.4, 5.0}) {
      Survey survey(0);
      survey.turn({0, 0, 0}, 12);
      survey.turn({0.3, 0.1, 0.2}, 12);
      survey.input.captures_are_checked = is_checked;
      survey.input.captures[9].detections[6].pixel +=
          sigmas * survey.sigma_px * Eigen::Vector2d(0.6, -0.8);
      const AdjustmentResult found = adjust_bundle(survey.input);
      ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
      EXPECT_EQ(found.detections + found.rejected_detections, 24 * 8);
      EXPECT_EQ(found.rejected_detections, sigmas > 4.5 ? 1 : 0) << is_checked << sigmas;
      EXPECT_EQ(found.noise_scale, 1);
      if (found.rejected_detections > 0) EXPECT_LT(found.residual_px, 1e-6);
    }
  }
}

/// Without sigma, the limit follows from the median of the residuals, which are the noise but for
/// few degrees of freedom.
TEST_F(AdjustBundleOutliers, OutlierLimitFollowsFromMedianResidualWithoutSigma) {
  constexpr double noise_px = 0.02;
  for (const bool is_checked : {true, false}) {
    for (const double fraction : {0.85, 1.2}) {
      Random random(7);
      Survey survey(0);
      survey.turn({0, 0, 0}, 12);
      survey.turn({0.3, 0.1, 0.2}, 12);
      survey.input.captures_are_checked = is_checked;
      std::vector<double> squares_px2;
      Detection* const outlier = &survey.input.captures[9].detections[6];
      const Eigen::Vector2d true_px = outlier->pixel;
      for (AdjustmentCapture& capture : survey.input.captures) {
        for (Detection& detection : capture.detections) {
          const Eigen::Vector2d error_px =
              noise_px * Eigen::Vector2d{random.normal(), random.normal()};
          detection.pixel += error_px;
          detection.sigma_px.reset();
          squares_px2.push_back(error_px.squaredNorm());
        }
      }
      const double rows = 2 * static_cast<double>(squares_px2.size());
      const double limit_px =
          std::sqrt(estimate_variance_2d(squares_px2, rows) * compute_outlier_bound_2d(4.5, rows));
      ASSERT_NEAR(limit_px / noise_px, 4.8, 0.6);
      outlier->pixel = true_px + fraction * limit_px * Eigen::Vector2d(0.6, -0.8);
      const AdjustmentResult found = adjust_bundle(survey.input);
      ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
      EXPECT_EQ(found.rejected_detections, fraction > 1 ? 1 : 0) << fraction << is_checked;
      double sum_px2 = std::accumulate(squares_px2.begin(), squares_px2.end(), 0.0);
      sum_px2 -= squares_px2[9 * 8 + 6];
      if (fraction < 1) sum_px2 += fraction * fraction * limit_px * limit_px;
      EXPECT_NEAR(found.noise_scale / std::sqrt(sum_px2 / rows), 1, 0.05);
      EXPECT_FALSE(found.noise_is_contradicted);
    }
  }
}

/// A wrong lamp of the map is below the camera, where the lens does not image it.
TEST_F(AdjustBundleOutliers, DetectionOfLampBelowCameraIsRejected) {
  Survey survey;
  survey.five_places(1e-4);
  survey.input.lamps.lamps.push_back({9, {0.2, 0.3, -1}, {}, {}, {}, 0.002});
  std::vector<Detection>& detections = survey.input.captures[0].detections;
  detections.insert(detections.begin(), {9, {500, 350}, 0.03});
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.rejected_detections, 1);
  EXPECT_EQ(found.detections, 60 * 8);
  EXPECT_LT(found.residual_px, 1e-6);
}

TEST_F(AdjustBundleOutliers, CaptureWithoutInlierCountsAsRejected) {
  Survey survey;
  survey.five_places(1e-4);
  std::vector<Detection>& detections = survey.input.captures[17].detections;
  detections.resize(2);
  std::swap(detections[0].lamp, detections[1].lamp);
  detections[0].pixel.x() += 40;
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.captures, 59);
  EXPECT_EQ(found.rejected_captures, 1);
  EXPECT_EQ(found.detections, 59 * 8);
  EXPECT_EQ(found.rejected_detections, 2);
}

/// Tilt of 46 degrees, with an initial tilt that has an error of 1 degree, and an inclined robot.
/// Detections below the horizon are no lamps.
TEST_F(AdjustBundleOutliers, DetectionsBelowHorizonOfTiltedCameraAreRejected) {
  Survey survey;
  Calibration& truth = survey.truth.calibration;
  truth.camera = fisheye_camera();
  truth.rotation_center = tilted_by(truth.camera, 0.8, 0.7);
  survey.input.calibration.camera = truth.camera;
  survey.input.calibration.rotation_center = tilted_by(truth.camera, 0.79, 0.72);
  survey.five_places(1e-4);
  survey.truth.inclination = Inclination{0.3, -0.2};
  survey.stand({{0.2, -0.1, 0}, 2.0});
  survey.input.captures.back().inclination = survey.truth.inclination;
  const int detections = 60 * 8 + static_cast<int>(survey.input.captures.back().detections.size());
  std::vector<Detection>& first = survey.input.captures[0].detections;
  ASSERT_EQ(first.size(), 8U);
  const Lens lens(truth.camera.lens_model, truth.camera.intrinsics);
  const Eigen::Vector3d below_horizon =
      compute_level_from_camera_matrix(truth, Correction::all).transpose() *
      Eigen::Vector3d(-std::cos(0.7), -std::sin(0.7), -0.05);
  first[3].pixel = lens.project_point(below_horizon).value();
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.detections, detections - 1);
  EXPECT_EQ(found.rejected_detections, 0);
  EXPECT_EQ(found.captures, 61);
  EXPECT_THAT(found.center.zenith_in_camera, IsNear(truth.rotation_center->zenith_in_camera, 1e-8));
}

/// Without a row time, all pixels are read at the middle of the image.
TEST_F(AdjustBundleOutliers, MotionHasNoEffectWithoutRowTime) {
  Survey survey;
  survey.five_places(1e-4);
  survey.stand({{0.2, -0.1, 0}, 2.0});
  ASSERT_FALSE(survey.input.calibration.camera.row_time_s);
  survey.input.captures.back().motion = {{0.5, -0.3}, 0.7, 0, 0};
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.rejected_detections, 0);
  EXPECT_LT(found.residual_px, 1e-8);
}

/// Corrections of a free map neither shift, turn nor scale the lamps in view.
TEST_F(AdjustBundleOutliers, CorrectionsOfFreeMapNeitherShiftRotateNorScaleIt) {
  measure(0.05, 0.03);
  for (AdjustmentCapture& capture : input.captures) capture.known_position.reset();
  input.map_prior = MapPrior::frame;
  const AdjustmentResult found = adjust_bundle(input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.lamps.size(), 5U);
  Eigen::Vector3d mean_m(0, 0, 0);
  for (std::size_t i = 0; i < 5; ++i) mean_m += input.lamps.lamps[i].position_m / 5;
  Eigen::Vector3d shift_m(0, 0, 0);
  double turn_m2 = 0, scale_m2 = 0;
  ASSERT_EQ(found.refined_covariance.rows(), 16 + 3 * 5);
  Eigen::MatrixXd similarity = Eigen::MatrixXd::Zero(found.refined_covariance.rows(), 5);
  for (std::size_t i = 0; i < 5; ++i) {
    const Eigen::Vector3d p = input.lamps.lamps[i].position_m - mean_m;
    const Eigen::Vector3d& d = found.lamps[i].correction_m;
    EXPECT_GT(d.norm(), 1e-4);
    shift_m += d;
    turn_m2 += p.x() * d.y() - p.y() * d.x();
    scale_m2 += p.dot(d);
    auto rows = similarity.middleRows(16 + 3 * static_cast<Eigen::Index>(i), 3);
    rows.leftCols(3).setIdentity();
    rows.col(3) << -p.y(), p.x(), 0;
    rows.col(4) = p;
  }
  EXPECT_THAT(shift_m, IsNear(Eigen::Vector3d(0, 0, 0), 1e-8));
  EXPECT_NEAR(turn_m2, 0, 1e-8);
  EXPECT_NEAR(scale_m2, 0, 1e-8);
  // Standard deviation of the constraint.
  for (Eigen::Index i = 0; i < 5; ++i) {
    const Eigen::VectorXd direction = similarity.col(i).normalized();
    const double sd_m = std::sqrt(direction.dot(found.refined_covariance * direction));
    EXPECT_GT(sd_m, 0.9e-6) << i;
    EXPECT_LT(sd_m, 1.1e-6) << i;
  }
}

}  // namespace
}  // namespace vlp
