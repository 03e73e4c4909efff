// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/reference_point_fixes.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "calibration/dispersion/station.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using Estimate = ReferencePointFixes::Estimate;

Estimate make_estimate(const Eigen::Vector2d& error_m, double yaw_rad, double height_m = 2) {
  return {error_m, Eigen::Matrix2d::Identity(), yaw_rad, height_m, 0, 0};
}

OptionalFixes make_fixes_at_yaws(const std::vector<double>& yaws_rad) {
  OptionalFixes fixes;
  for (const double yaw_rad : yaws_rad) fixes.emplace_back(make_estimate({0, 0}, yaw_rad));
  return fixes;
}

/// Ratio of the squared 97.5 % bounds of Student's t (Wallace's approximation) and of the normal
/// distribution.
double compute_expected_student_ratio(double freedom) {
  const double z_squared = std::pow(1.96 * (1 + 2 / (8 * freedom + 1)), 2);
  return freedom * (std::exp(z_squared / freedom) - 1) / (1.96 * 1.96);
}

/// Bound of chi-squared per degree of freedom (Wilson and Hilferty), at `sigmas` standard
/// deviations of the normal distribution.
double compute_expected_chi_squared_ratio(double sigmas, double freedom) {
  const double variance = 2 / (9 * freedom);
  return std::pow(1 - variance + sigmas * std::sqrt(variance), 3);
}

TEST(ComputeSmallSampleVarianceFactor, IsRatioTimesSquaredStudentFactorWithoutStatedNoise) {
  // 97.5 % bounds of Student's t from tables.
  EXPECT_NEAR(compute_small_sample_variance_factor(1, 4, false), std::pow(2.776 / 1.96, 2), 0.04);
  EXPECT_NEAR(compute_small_sample_variance_factor(1, 20, false), std::pow(2.086 / 1.96, 2), 0.003);
  for (const double freedom : {2., 5., 17.}) {
    const double expected = compute_expected_student_ratio(freedom);
    EXPECT_NEAR(compute_small_sample_variance_factor(1, freedom, false), expected, 1e-12);
    EXPECT_NEAR(compute_small_sample_variance_factor(0.3, freedom, false), 0.3 * expected, 1e-12);
    EXPECT_NEAR(compute_small_sample_variance_factor(9, freedom, false, 1), 9 * expected, 1e-11);
  }
}

TEST(ComputeSmallSampleVarianceFactor, IsAtLeastOneForStatedNoise) {
  EXPECT_EQ(compute_small_sample_variance_factor(0, 40, true), 1);
  EXPECT_EQ(compute_small_sample_variance_factor(0.2, 8, true), 1);
}

/// Without contradiction, stated noise counts as an estimate with six degrees of freedom.
TEST(ComputeSmallSampleVarianceFactor, CombinesStatedNoiseAndResidualsThatAgree) {
  for (const double freedom : {4., 10., 40.}) {
    const double ratio = 1.02;
    ASSERT_LT(ratio, compute_expected_chi_squared_ratio(0.8416, freedom));
    const double expected =
        (6 + freedom * ratio) / (6 + freedom) * compute_expected_student_ratio(6 + freedom);
    ASSERT_GT(expected, 1);
    EXPECT_NEAR(compute_small_sample_variance_factor(ratio, freedom, true), expected, 1e-12);
  }
}

/// The factor changes from that of the stated noise to that of the residuals between the 80 % and
/// the 95 % quantile of chi-squared (0.8416 and 1.6449 standard deviations).
TEST(ComputeSmallSampleVarianceFactor, FollowsResidualsThatContradictStatedNoise) {
  for (const double freedom : {4., 10.}) {
    const double first = compute_expected_chi_squared_ratio(0.8416, freedom),
                 last = compute_expected_chi_squared_ratio(1.6449, freedom);
    for (const double weight : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const double ratio = first + weight * (last - first);
      const double combined =
          (6 + freedom * ratio) / (6 + freedom) * compute_expected_student_ratio(6 + freedom);
      const double from_residuals = ratio * compute_expected_student_ratio(freedom);
      ASSERT_GT(combined, 1);
      ASSERT_GT(from_residuals, combined);
      const double expected =
          std::exp((1 - weight) * std::log(combined) + weight * std::log(from_residuals));
      EXPECT_NEAR(compute_small_sample_variance_factor(ratio, freedom, true), expected, 1e-9)
          << weight;
    }
    EXPECT_NEAR(compute_small_sample_variance_factor(50, freedom, true),
                50 * compute_expected_student_ratio(freedom), 1e-9);
  }
}

TEST(ComputeSmallSampleVarianceFactor, PooledRatioDeterminesContradiction) {
  constexpr double freedom = 10, ratio = 4;
  const double combined =
      (6 + freedom * ratio) / (6 + freedom) * compute_expected_student_ratio(6 + freedom);
  EXPECT_NEAR(compute_small_sample_variance_factor(ratio, freedom, true, 1), combined, 1e-12);
  EXPECT_NEAR(compute_small_sample_variance_factor(ratio, freedom, true, 30),
              ratio * compute_expected_student_ratio(freedom), 1e-12);
  // Residuals of one axis below the stated noise do not reduce it.
  EXPECT_EQ(compute_small_sample_variance_factor(0.1, freedom, true, 30), 1);
}

TEST(MeanFix, YawVariationIsRootOfOneMinusSquaredHeading) {
  MeanFix mean;
  mean.heading = {0.36, 0.48};
  EXPECT_NEAR(mean.compute_capture_yaw_variation(), 0.8, 1e-12);
  mean.heading = {1 + 1e-12, 0};
  EXPECT_EQ(mean.compute_capture_yaw_variation(), 0);
}

TEST(MeanFix, YawsAreSimilarWithinTenDegreesOfMean) {
  for (const double middle_rad : {0.0, 2.0}) {
    const auto are_similar = [&](double deg) {
      const double deviation_rad = rad_from_deg(deg);
      return compute_mean_fix(
                 make_fixes_at_yaws({middle_rad - deviation_rad, middle_rad + deviation_rad}),
                 {true, true})
          .are_capture_yaws_similar();
    };
    EXPECT_TRUE(are_similar(0));
    EXPECT_TRUE(are_similar(9.9));
    EXPECT_FALSE(are_similar(10.1));
    EXPECT_FALSE(are_similar(90));
  }
}

TEST(ComputeMeanFix, AveragesHeadingsAndHeightsOfUsedFixesOnly) {
  const OptionalFixes fixes = {
      make_estimate({0, 0}, 0, 1), std::nullopt, make_estimate({0, 0}, std::numbers::pi / 2, 2),
      make_estimate({0, 0}, 3, 100), make_estimate({0, 0}, std::numbers::pi, 6)};
  const MeanFix mean = compute_mean_fix(fixes, {true, true, true, false, true});
  EXPECT_EQ(mean.count, 3);
  EXPECT_NEAR(mean.height_m, 3, 1e-12);
  EXPECT_THAT(mean.heading, IsNear(Eigen::Vector2d(0, 1. / 3), 1e-12));
}

TEST(IsYawVariationDueToOneFix, ReturnsTrueOnlyIfAllOtherUsedFixesHaveOneYaw) {
  const auto with_all_used = [](const std::vector<double>& yaws_rad) {
    return is_yaw_variation_due_to_one_fix(make_fixes_at_yaws(yaws_rad),
                                           std::vector<bool>(yaws_rad.size(), true));
  };
  EXPECT_TRUE(with_all_used({0, 0, 0, 1}));
  EXPECT_TRUE(with_all_used({1, 0, 0, 0}));
  EXPECT_TRUE(with_all_used({0, 0, 1, 0}));
  EXPECT_FALSE(with_all_used({0, 0, 1, 1}));
  EXPECT_FALSE(with_all_used({0, 1, 2, 3}));
  EXPECT_FALSE(is_yaw_variation_due_to_one_fix({}, {}));
}

TEST(IsYawVariationDueToOneFix, IgnoresUnusedAndMissingFixes) {
  OptionalFixes fixes = make_fixes_at_yaws({0, 0, 0, 1, 1});
  EXPECT_FALSE(is_yaw_variation_due_to_one_fix(fixes, {true, true, true, true, true}));
  EXPECT_TRUE(is_yaw_variation_due_to_one_fix(fixes, {true, true, true, true, false}));
  fixes[3].reset();
  EXPECT_TRUE(is_yaw_variation_due_to_one_fix(fixes, {true, true, true, true, true}));
}

TEST(AreAllFixesFarFromReferencePoint, ComparesErrorsWithFifthOfHeight) {
  const auto at = [](double error_m) {
    return make_estimate({0.6 * error_m, 0.8 * error_m}, 0, 2);
  };
  EXPECT_TRUE(are_all_fixes_far_from_reference_point({at(0.41)}));
  EXPECT_FALSE(are_all_fixes_far_from_reference_point({at(0.39)}));
  EXPECT_TRUE(are_all_fixes_far_from_reference_point({at(3), std::nullopt, at(0.41)}));
  EXPECT_FALSE(are_all_fixes_far_from_reference_point({at(3), at(0.39), at(0.41)}));
}

/// Nine fixes around (1, -2). The median of the squared distances is 1, that of a normal
/// distribution in two dimensions is 2 ln 2 variances. The bound for 16 degrees of freedom and five
/// standard deviations is a quantile of the F distribution, as the median has the efficiency
/// (ln 2)^2.
TEST(FlagFixesNearMedian, RejectsFixBeyondFiveStandardDeviationsOfMedian) {
  const auto flags = [](const Eigen::Vector2d& displacement_m) {
    OptionalFixes fixes;
    for (const Eigen::Vector2d& offset_m :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0),
          Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1), Eigen::Vector2d(2, 0),
          Eigen::Vector2d(-2, 0), Eigen::Vector2d(0, 2), displacement_m}) {
      fixes.emplace_back(make_estimate(Eigen::Vector2d(1, -2) + offset_m, 0));
    }
    fixes.insert(fixes.begin() + 3, std::nullopt);
    return flag_fixes_near_median(fixes);
  };
  const double variance = 1 / (2 * std::log(2.)) * 18 / 16;
  const double m = 16 * std::pow(std::log(2.), 2);
  const double limit = std::sqrt(m * (std::exp(25 / m) - 1) * variance);
  std::vector<bool> expected(10, true);
  expected[3] = false;
  EXPECT_EQ(flags({0.99 * limit, 0}), expected);
  EXPECT_EQ(flags({0, -0.99 * limit}), expected);
  expected[9] = false;
  EXPECT_EQ(flags({1.01 * limit, 0}), expected);
  EXPECT_EQ(flags({0, -1.01 * limit}), expected);
}

TEST(FlagFixesNearMedian, ToleratesRoundingOfEqualFixes) {
  OptionalFixes fixes(7, make_estimate({0.1, 0.2}, 0));
  fixes[2]->error_m.x() += 1e-12;
  fixes[5]->error_m.y() += 1e-9;
  const std::vector<bool> expected = {true, true, true, true, true, false, true};
  EXPECT_EQ(flag_fixes_near_median(fixes), expected);
}

TEST(LampDerivatives, ScaledJacobianHasStandardDeviationOfEachLampInItsColumns) {
  LampDerivatives derivatives;
  derivatives.lamps = make_lamp_map({{0, 0, 2}, {1, 0, 2}}).lamps;
  derivatives.lamps[0].sd_m = 0.5;
  derivatives.lamps[1].sd_m = 3;
  derivatives.jacobian_wrt_positions.resize(2, 6);
  derivatives.jacobian_wrt_positions << 1, 2, 3, 4, 5, 6, -1, -2, -3, -4, -5, -6;
  Eigen::MatrixXd expected(2, 6);
  expected << 0.5, 1, 1.5, 12, 15, 18, -0.5, -1, -1.5, -12, -15, -18;
  EXPECT_EQ(derivatives.scale_jacobian_by_lamp_sds(), expected);
}

/// Station under lamps at several heights.
struct UnevenStation {
  UnevenStation() {
    for (std::size_t i = 0; i < station.rig.map.lamps.size(); ++i) {
      station.rig.map.lamps[i].position_m.z() += 0.03 * static_cast<double>(i);
    }
  }

  Station station{0};
};

/// Station::captures() has the yaws 6.28 i / 6, and every second capture is 0.3 m higher.
TEST(ReferencePointFixes, ReturnsErrorYawAndHeightOfEachFix) {
  UnevenStation setup;
  Station& station = setup.station;
  auto captures = station.captures(6, true, {0.004, -0.003});
  captures[1].detections.erase(captures[1].detections.begin() + 2, captures[1].detections.end());
  captures[2].detections.push_back({99, {10, 20}, 0.1});  // not in the map
  captures[3].detections.clear();
  const ReferencePointFixes fixes(captures, station.rig.map, station.believed);
  const OptionalFixes found = fixes.compute_capture_fixes_with_dispersion_offset({0, 0});
  ASSERT_EQ(found.size(), 6U);
  EXPECT_FALSE(found[3]);
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{5}}) {
    SCOPED_TRACE(i);
    ASSERT_TRUE(found[i]);
    EXPECT_THAT(found[i]->error_m, IsNear(Eigen::Vector2d(0.004, -0.003), 1e-9));
    EXPECT_NEAR(wrap_angle_rad(found[i]->yaw_rad - 6.28 * static_cast<double>(i) / 6), 0, 1e-9);
    // Mean height of two or eight lamps.
    const double lamps_z_m = i == 1 ? 1.6 + 0.03 / 2 : 1.6 + 0.03 * 3.5;
    EXPECT_NEAR(found[i]->height_m, lamps_z_m - (i % 2 == 1 ? 0.3 : 0), 1e-9);
    EXPECT_EQ(found[i]->degrees_of_freedom, i == 1 ? 0 : 12);
    EXPECT_LT(found[i]->squared_residuals_px2, 1e-12);
  }
  EXPECT_EQ(fixes.first_failed_fix_status(), FixStatus::too_few_lamps);
}

TEST(ReferencePointFixes, StatisticsMatchPositionerForNoisyDetections) {
  Station station(0.01);
  station.believed.dispersion = Dispersion{{50, 60}, 0, {0, 0}, 1};  // is ignored
  for (Lamp& lamp : station.rig.map.lamps) lamp.sd_m = 0.01;
  Random random(8);
  auto captures = station.captures(4, true, {0, 0});
  for (auto& capture : captures) capture.detections = with_noise(capture.detections, random);
  const ReferencePointFixes fixes(captures, station.rig.map, station.believed);
  const Eigen::Vector2d offset_px(3, -2);
  const OptionalFixes found = fixes.compute_capture_fixes_with_dispersion_offset(offset_px);
  Calibration calibration = station.believed;
  calibration.dispersion->offset_px = offset_px;
  const Positioner positioner(station.rig.map, calibration);
  ASSERT_EQ(found.size(), captures.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Fix fix = positioner.compute_position_fix(captures[i].detections);
    ASSERT_TRUE(fix.has_succeeded() && found[i]);
    ASSERT_EQ(fix.lamps, 8);
    EXPECT_THAT(found[i]->covariance,
                IsNear(Eigen::Matrix2d(fix.noise_covariance.topLeftCorner<2, 2>()), 1e-15));
    EXPECT_NEAR(found[i]->squared_residuals_px2, 8 * fix.residual_px * fix.residual_px, 1e-9);
    EXPECT_GT(found[i]->squared_residuals_px2, 1e-3);
    EXPECT_THAT(found[i]->error_m,
                IsNear(fix.state.pose.position_m.head<2>() - captures[i].reference_point_m, 1e-12));
  }
}

TEST(ReferencePointFixes, ReturnsStatusOfFirstCaptureWithoutFix) {
  Station station(0);
  auto captures = station.captures(4, false, {0, 0});
  EXPECT_EQ(
      ReferencePointFixes(captures, station.rig.map, station.believed).first_failed_fix_status(),
      FixStatus::ok);
  captures[1].detections[1].lamp = captures[1].detections[0].lamp;
  captures[2].detections.clear();
  EXPECT_EQ(
      ReferencePointFixes(captures, station.rig.map, station.believed).first_failed_fix_status(),
      FixStatus::duplicate_lamp);
}

TEST(ReferencePointFixes, JacobianOmitsExactAndUndetectedLampsAndIsZeroWithoutFix) {
  Station station(0);
  auto captures = station.captures(3, false, {0, 0});
  for (Lamp& lamp : station.rig.map.lamps) lamp.sd_m = 0.002;
  station.rig.map.lamps[0].sd_m = 0;
  station.rig.map.lamps[2].sd_m.reset();
  station.rig.map.lamps[5].sd_m = 1e-6;
  for (auto& capture : captures) {
    std::erase_if(capture.detections, [](const Detection& seen) { return seen.lamp == 5; });
  }
  captures[1].detections.resize(1);
  const ReferencePointFixes fixes(captures, station.rig.map, station.believed);
  const LampDerivatives found = fixes.compute_fix_jacobian_wrt_lamps({0, 0});
  std::vector<int> ids;
  for (const Lamp& lamp : found.lamps) ids.push_back(lamp.id);
  EXPECT_THAT(ids, testing::ElementsAre(2, 4, 6, 7, 8));
  ASSERT_EQ(found.jacobian_wrt_positions.rows(), 6);
  ASSERT_EQ(found.jacobian_wrt_positions.cols(), 15);
  EXPECT_TRUE(found.jacobian_wrt_positions.middleRows<2>(2).isZero(0));
  EXPECT_GT(found.jacobian_wrt_positions.topRows<2>().norm(), 0.1);
  EXPECT_GT(found.jacobian_wrt_positions.bottomRows<2>().norm(), 0.1);
  for (Lamp& lamp : station.rig.map.lamps) lamp.sd_m.reset();
  const LampDerivatives none = fixes.compute_fix_jacobian_wrt_lamps({0, 0});
  EXPECT_TRUE(none.lamps.empty());
  EXPECT_EQ(none.jacobian_wrt_positions.rows(), 6);
  EXPECT_EQ(none.jacobian_wrt_positions.cols(), 0);
}

}  // namespace
}  // namespace vlp
