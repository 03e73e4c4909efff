// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/adjustment/adjustment.h"

#include <gmock/gmock.h>

#include "calibration/adjustment/survey.h"
#include "support/matchers.h"

namespace vlp {
namespace {

using testing::HasSubstr;

std::vector<int> moved_lamps(const AdjustmentResult& result) {
  std::vector<int> ids;
  for (const auto& lamp : result.lamps) {
    if (lamp.is_moved) ids.push_back(lamp.id);
  }
  return ids;
}

TEST(AdjustBundle, RecoversZenithLeverArmAndLampsExactlyWithoutNoise) {
  Survey survey;
  survey.five_places(1e-4);
  survey.stand({{0.2, -0.1, 0}, 2.0});
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.captures, 61);
  EXPECT_THAT(found.center.zenith_in_camera,
              IsNear(survey.truth.calibration.rotation_center->zenith_in_camera, 1e-9));
  ASSERT_TRUE(found.center.lever_arm_m);
  ASSERT_EQ(found.refined_map.lamps.size(), 8U);
  ASSERT_EQ(found.lamps.size(), 8U);
  EXPECT_THAT(*found.center.lever_arm_m, IsNear(survey.lever_arm_m, 1e-9));
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_THAT(survey.misplaced(i, found.refined_map), IsNear(Eigen::Vector3d(0, 0, 0), 1e-9));
  }
  EXPECT_LT(found.residual_px, 1e-8);
  EXPECT_EQ(found.noise_scale, 1);
  EXPECT_TRUE(moved_lamps(found).empty());
}

TEST(AdjustBundle, ReducesMapErrorsOfMillimetersOrCentimetersToSubmillimeter) {
  for (const double sd_m : {0.002, 0.02}) {
    Random random(3);
    Survey survey(sd_m);
    survey.five_places(1e-4);
    survey.add_noise(random, true, true, true);
    const AdjustmentResult found = adjust_bundle(survey.input);
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    ASSERT_EQ(found.refined_map.lamps.size(), 8U);
    ASSERT_EQ(found.lamps.size(), 8U);
    double worst_xy_m = 0, worst_z_m = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const Eigen::Vector3d error_m = survey.misplaced(i, found.refined_map);
      worst_xy_m = std::max(worst_xy_m, error_m.head<2>().norm());
      worst_z_m = std::max(worst_z_m, std::abs(error_m.z()));
      EXPECT_NEAR(found.refined_map.lamps[i].sd_m.value(), 1e-4, 1e-4);
    }
    RecordProperty("xy_um", static_cast<int>(1e6 * worst_xy_m));
    EXPECT_LT(worst_xy_m, 2.5e-4) << sd_m;
    EXPECT_LT(worst_z_m, 3e-4) << sd_m;
    EXPECT_TRUE(moved_lamps(found).empty());
  }
}

/// Survey with sd 0.5 mm, pixel noise as in real captures.
TEST(AdjustBundle, ReportsAndRelocatesAnyLampMovedByThreeMillimeters) {
  for (std::size_t moved = 0; moved < 8; ++moved) {
    Random random(50 + moved);
    Survey survey(0.0005);
    survey.sigma_px = 0.1;
    survey.five_places(1e-4);
    survey.add_noise(random, true, true, true);
    survey.input.lamps.lamps[moved].position_m.head<2>() =
        survey.truth.map.lamps[moved].position_m.head<2>() + Eigen::Vector2d(0.0024, -0.0018);
    const AdjustmentResult found = adjust_bundle(survey.input);
    ASSERT_TRUE(found.has_succeeded());
    EXPECT_EQ(moved_lamps(found), std::vector<int>{static_cast<int>(moved) + 1});
    EXPECT_THAT(survey.misplaced(moved, found.refined_map), IsNear(Eigen::Vector3d(0, 0, 0), 5e-4));
  }
}

TEST(AdjustBundle, RecoversAllLampsExactlyWhenOneIsMoved) {
  Survey survey(0.001);
  survey.turn({0, 0, 0}, 12);
  survey.turn({0.3, 0.1, 0.3}, 12);
  survey.input.lamps.lamps[4].position_m += Eigen::Vector3d(0.02, -0.02, 0);
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.refined_map.lamps.size(), 8U);
  EXPECT_EQ(moved_lamps(found), std::vector<int>{5});
  // Without the survey of the moved lamp, the other lamps are exact.
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_THAT(survey.misplaced(i, found.refined_map), IsNear(Eigen::Vector3d(0, 0, 0), 1e-7));
  }
  EXPECT_THAT(found.notes, testing::Contains(HasSubstr(
                               "0 known positions: only the survey determines position, yaw and "
                               "scale of the map; captures at 3 more known positions")));
}

TEST(AdjustBundle, AsksForSecondHeightForOneCaptureOfTwoLamps) {
  Survey survey;
  survey.turn({0, 0, 0}, 1);
  survey.input.captures[0].detections.resize(2);
  EXPECT_THAT(adjust_bundle(survey.input).undetermined, HasSubstr("a second height"));
  survey.turn({0, 0, 0.3}, 12);
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_TRUE(found.center.lever_arm_m);
  EXPECT_THAT(*found.center.lever_arm_m, IsNear(survey.lever_arm_m, 1e-6));
}

TEST(AdjustBundle, ListsUnknownsUndeterminedByOneOrTwoKnownPositions) {
  Survey survey(0.001);
  survey.turn({0, 0, 0}, 12, 1e-4);
  EXPECT_THAT(adjust_bundle(survey.input).notes,
              testing::Contains("1 known position: only the survey determines yaw and scale of the "
                                "map; captures at 2 more known positions would determine it"));
  survey.turn({0.5, 0.25, 0}, 12, 1e-4);
  EXPECT_THAT(adjust_bundle(survey.input).notes,
              testing::Contains(HasSubstr("2 known positions: only the survey determines rotation "
                                          "of the map about the line through both positions; "
                                          "captures at 1 more known position")));
  survey.turn({-0.5, 0.25, 0.1}, 12, 1e-4);
  EXPECT_THAT(adjust_bundle(survey.input).notes,
              testing::Not(testing::Contains(HasSubstr("only the survey determines"))));
}

/// Initial lens of another camera: focal lengths 4 % and 3 % too small, and different distortion.
TEST(AdjustBundle, RecoversFocalLengthsAndPrincipalPointFromWrongInitialLens) {
  Random random(8);
  Survey survey(0.002);
  Camera& camera = survey.input.calibration.camera;
  const std::vector<double> truth = camera.intrinsics;
  survey.five_places(1e-4);
  survey.add_noise(random, true, true, true);
  camera.intrinsics[0] *= 0.96;
  camera.intrinsics[1] *= 0.97;
  camera.intrinsics[2] += 5;
  camera.intrinsics[4] += 0.03;
  survey.input.calibration.intrinsics_report.emplace();
  survey.input.calibration.intrinsics_report->covariance = make_intrinsics_covariance(camera, 10);
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_TRUE(found.center.lever_arm_m);
  ASSERT_EQ(found.lamps.size(), 8U);
  EXPECT_FALSE(found.lens_is_contradicted);
  EXPECT_TRUE(moved_lamps(found).empty());
  EXPECT_LT(found.residual_px, 1.1 * survey.sigma_px);
  for (std::size_t i = 0; i < 4; ++i) {
    const double sd = std::sqrt(found.refined_covariance(static_cast<int>(i), static_cast<int>(i)));
    EXPECT_LT(sd, 0.5);
    EXPECT_NEAR(found.camera.intrinsics[i], truth[i], 3 * sd);
  }
  EXPECT_THAT(*found.center.lever_arm_m, IsNear(survey.lever_arm_m, 2e-4));
}

TEST(AdjustBundle, RejectsBothDetectionsWithSwappedLampIds) {
  Survey survey;
  survey.five_places(1e-4);
  std::swap(survey.input.captures[7].detections[0].lamp,
            survey.input.captures[7].detections[3].lamp);
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded());
  ASSERT_TRUE(found.center.lever_arm_m);
  EXPECT_EQ(found.rejected_detections, 2);
  EXPECT_THAT(*found.center.lever_arm_m, IsNear(survey.lever_arm_m, 1e-7));
}

TEST(AdjustBundle, ReturnsIdenticalZenithAndCovarianceWhenRepeated) {
  Random random(5);
  Survey survey(0.002);
  survey.five_places(1e-4);
  survey.add_noise(random, true, true, true);
  const AdjustmentResult once = adjust_bundle(survey.input);
  const std::vector<double> elsewhere(12345);  // other addresses
  const AdjustmentResult again = adjust_bundle(survey.input);
  ASSERT_TRUE(once.has_succeeded()) << once.undetermined;
  EXPECT_EQ(once.refined_covariance, again.refined_covariance);
  EXPECT_EQ(once.center.zenith_in_camera, again.center.zenith_in_camera);
}

}  // namespace
}  // namespace vlp
