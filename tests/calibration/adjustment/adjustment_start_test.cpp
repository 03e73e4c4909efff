// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Start values of adjust_bundle(), and inputs that determine only some of the unknowns.
#include <gmock/gmock.h>

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "calibration/adjustment/adjustment.h"
#include "calibration/adjustment/survey.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

/// Removes all detections of a capture except those of `lamps`, and sorts them in this order.
void keep_lamps_in_order(AdjustmentCapture& capture, const std::vector<int>& lamps) {
  std::vector<Detection> kept;
  for (const int lamp : lamps) {
    for (const Detection& detection : capture.detections) {
      if (detection.lamp == lamp) kept.push_back(detection);
    }
  }
  ASSERT_EQ(kept.size(), lamps.size());
  capture.detections = kept;
}

/// Level pinhole camera below two lamps at 2 m, whose centers are `distance_px` apart in the image.
AdjustmentInput make_input_of_two_lamps(const Eigen::Vector2d& distance_px) {
  AdjustmentInput input;
  input.calibration.camera = {"", {800, 600}, LensModel::pinhole, {500, 400, 399.5, 299.5}, {},
                              {}, {}};
  const Eigen::Vector2d half_m = distance_px.cwiseQuotient(Eigen::Vector2d(500, 400));
  input.lamps = make_lamp_map({{-half_m.x(), -half_m.y(), 2}, {half_m.x(), half_m.y(), 2}});
  for (Lamp& lamp : input.lamps.lamps) lamp.sd_m = 0;
  const Eigen::Vector2d center_px(399.5, 299.5);
  input.captures.push_back(
      {"two lamps",
       {{1, center_px - distance_px / 2, 0.01}, {2, center_px + distance_px / 2, 0.01}}});
  return input;
}

/// One detection in a corner of the map has the id of a lamp beyond the opposite corner. The pose
/// from all four lamps is turned by half a turn. The pose of the other three lamps is right.
TEST(AdjustBundleInitialPoses, FitsPoseToThreeLampsIfOneOfFourIsMisidentified) {
  Survey survey;
  survey.five_places(1e-4);
  survey.input.lamps.lamps.push_back({9, {1.5, 0.9, 1.6}, {}, {}, {}, 0.002});
  survey.stand({{0.1, 0.05, 0}, 0.4});
  AdjustmentCapture& capture = survey.input.captures.back();
  keep_lamps_in_order(capture, {8, 7, 5, 1});
  capture.detections[3].lamp = 9;
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.rejected_detections, 1);
  EXPECT_EQ(found.detections, 60 * 8 + 3);
  EXPECT_EQ(found.captures, 61);
  EXPECT_LT(found.residual_px, 1e-6);
}

/// Map with errors of 5 mm. Only the first captures contain two lamps of equal x and y. Swapped
/// lamps in opposite corners turn the pose from all lamps of the last capture by half a turn.
TEST(AdjustBundleInitialPoses, FitsPoseToLampsThatAgreeRelativeToTheirDistances) {
  Survey survey(0.005);
  survey.truth.map.lamps[1].position_m = {0.5, 0.05, 1.7};  // below it, lamp 7 at 1.59 m
  survey.input.lamps = survey.truth.map;
  survey.five_places(1e-4);
  survey.stand({{0.1, 0.05, 0}, 0.4});
  survey.input.lamps.lamps[7].position_m += Eigen::Vector3d(0.004, -0.003, 0.002);
  survey.input.lamps.lamps[5].position_m += Eigen::Vector3d(-0.003, 0.004, 0.002);
  AdjustmentCapture& capture = survey.input.captures.back();
  keep_lamps_in_order(capture, {5, 6, 8, 1, 3});
  std::swap(capture.detections[3].lamp, capture.detections[4].lamp);
  for (std::size_t k = 0; k < 60; ++k) ASSERT_EQ(survey.input.captures[k].detections.size(), 8U);
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.rejected_detections, 2);
  EXPECT_EQ(found.captures, 61);
  EXPECT_LT(found.residual_px, 1e-3);
}

/// Two lamps at a distance of d px determine the height H with the standard deviation H sqrt(2) /
/// d, if the noise is 1 px. It must be below H.
TEST(AdjustBundleInitialPoses, RejectsCaptureOfTwoLampsCloserThanRootTwoPixels) {
  for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)}) {
    AdjustmentInput input = make_input_of_two_lamps(1.3 * direction);
    const AdjustmentResult near = adjust_bundle(input);
    EXPECT_FALSE(near.has_succeeded());
    EXPECT_EQ(near.rejected_captures, 1);
    EXPECT_EQ(near.captures, 0);
    EXPECT_EQ(near.rejected_detections, 0);
    EXPECT_EQ(near.refined_map.lamps.size(), 2U);
    EXPECT_EQ(near.camera.intrinsics, input.calibration.camera.intrinsics);
    input = make_input_of_two_lamps(1.55 * direction);
    const AdjustmentResult apart = adjust_bundle(input);
    EXPECT_EQ(apart.rejected_captures, 0);
    EXPECT_EQ(apart.captures, 1);
    EXPECT_EQ(apart.detections, 2);
  }
}

/// The only capture at the pivot has one lamp.
TEST(AdjustBundleInitialPoses, PivotWithoutFixDoesNotChangeResult) {
  Survey survey;
  survey.five_places(1e-4);
  const AdjustmentResult without = adjust_bundle(survey.input);
  survey.turn({0.1, 0.2, 0}, 1);
  survey.input.captures.back().detections.resize(1);
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(without.has_succeeded()) << without.undetermined;
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  EXPECT_EQ(found.rejected_captures, 1);
  EXPECT_EQ(found.captures, 60);
  EXPECT_THAT(found.center.zenith_in_camera, IsNear(without.center.zenith_in_camera, 1e-10));
  ASSERT_EQ(found.refined_covariance.rows(), without.refined_covariance.rows());
  EXPECT_THAT(found.refined_covariance, IsNear(without.refined_covariance, 1e-12));
}

/// Coordinates of a national grid. The shift is a power of two, and adds no rounding.
TEST(AdjustBundleInitialPoses, PosesAreExactFarFromOriginOfWorld) {
  const Eigen::Vector3d shift_m(4194304, -2097152, 524288);
  Survey survey;
  for (LampMap* const map : {&survey.truth.map, &survey.input.lamps}) {
    for (Lamp& lamp : map->lamps) {
      lamp.position_m = (1024 * lamp.position_m).array().round().matrix() / 1024;
    }
  }
  survey.five_places(1e-3);
  for (Lamp& lamp : survey.input.lamps.lamps) lamp.position_m += shift_m;
  for (AdjustmentCapture& capture : survey.input.captures) {
    capture.known_position->xy_m += shift_m.head<2>();
    *capture.known_position->z_m += shift_m.z();
  }
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.lamps.size(), 8U);
  ASSERT_TRUE(found.center.lever_arm_m);
  EXPECT_LT(found.residual_px, 1e-7);
  EXPECT_THAT(*found.center.lever_arm_m, IsNear(survey.lever_arm_m, 1e-9));
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_THAT(found.lamps[i].correction_m, IsNear(Eigen::Vector3d(0, 0, 0), 1e-8));
    EXPECT_THAT(survey.misplaced(i, found.refined_map), IsNear(shift_m, 1e-8));
  }
}

/// The camera is 1.4 m from its axis. Its lever arm is calibrated, and each pivot has few captures.
TEST(AdjustBundleInitialPoses, UsesCalibratedLeverArm) {
  Survey survey;
  survey.lever_arm_m = {1.2, -0.7};
  survey.input.calibration.rotation_center = survey.truth.calibration.rotation_center;
  survey.input.calibration.rotation_center->lever_arm_m = survey.lever_arm_m;
  for (const double x_m : {-0.9, 0.4}) {
    for (const double z_m : {0.0, 0.2}) survey.turn({x_m, 0.3, z_m}, 2);
    survey.turn({x_m, -0.4, 0.1}, 1);
  }
  const AdjustmentResult found = adjust_bundle(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_TRUE(found.center.lever_arm_m);
  EXPECT_THAT(*found.center.lever_arm_m, IsNear(survey.lever_arm_m, 1e-8));
  EXPECT_EQ(found.captures, 10);
  EXPECT_EQ(found.rejected_detections, 0);
  EXPECT_LT(found.residual_px, 1e-6);
}

/// The lever arm follows from known positions of the axis, without a pivot.
TEST(AdjustBundleInitialPoses, AxisPositionsDetermineLeverArmButCameraPositionsDoNot) {
  for (const MeasuredPoint point : {MeasuredPoint::axis, MeasuredPoint::camera}) {
    Survey survey(0);
    survey.turn({0, 0, 0}, 4, 1e-3, point);
    survey.turn({0.3, 0.1, 0.2}, 3, 1e-3, point);
    for (AdjustmentCapture& capture : survey.input.captures) capture.pivot.clear();
    const AdjustmentResult found = adjust_bundle(survey.input, {0.005, 1e9});
    ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
    EXPECT_LT(found.residual_px, 1e-6);
    if (point == MeasuredPoint::camera) {
      EXPECT_FALSE(found.center.lever_arm_m);
      EXPECT_EQ(found.known_positions.size(), 7U);
      continue;
    }
    ASSERT_TRUE(found.center.lever_arm_m);
    EXPECT_THAT(*found.center.lever_arm_m, IsNear(survey.lever_arm_m, 1e-8));
    ASSERT_EQ(found.known_positions.size(), 2U);
    EXPECT_EQ(found.known_positions[0].name, "spot-0/0");
    EXPECT_EQ(found.known_positions[0].captures, 4);
    EXPECT_EQ(found.known_positions[1].name, "spot-4/0");
    EXPECT_EQ(found.known_positions[1].captures, 3);
  }
}

TEST(AdjustBundleInitialPoses, FailsForKnownPositionThatIsNan) {
  for (const bool is_checked : {true, false}) {
    Survey survey;
    survey.turn({0, 0, 0}, 2, 1e-3);
    survey.input.captures_are_checked = is_checked;
    survey.input.captures[0].known_position->xy_m.x() = std::numeric_limits<double>::quiet_NaN();
    const AdjustmentResult found = adjust_bundle(survey.input);
    EXPECT_FALSE(found.has_succeeded());
    EXPECT_EQ(found.refined_map.lamps.size(), 8U);
    EXPECT_EQ(found.camera.intrinsics, survey.input.calibration.camera.intrinsics);
    EXPECT_EQ(found.rejected_detections, 16);
    EXPECT_EQ(found.detections, 0);
  }
}

}  // namespace
}  // namespace vlp
