// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/dispersion_step.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "rig/calibration_error.h"
#include "support/body_rig.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(CollectKnownCaptures, UsesGivenPositionForCapturesWithoutOneInTable) {
  const std::vector<Frame> frames{{"both", {}}, {"only x", {}}, {"not in table", {}}};
  CapturesTable table;
  table["both"].x_m = 1;
  table["both"].y_m = 2;
  table["both"].measured_point = MeasuredPoint::axis;
  table["both"].inclination = Inclination{0.1, 0.2};
  table["only x"].x_m = 3;
  const KnownPositions of_table = collect_known_captures(frames, table);
  ASSERT_EQ(of_table.captures.size(), 1U);
  EXPECT_EQ(of_table.captures[0].reference_point_m, Eigen::Vector2d(1, 2));
  ASSERT_TRUE(of_table.captures[0].inclination);
  EXPECT_EQ(of_table.captures[0].inclination->pitch_rad, 0.2);
  EXPECT_THAT(of_table.measured_points, ElementsAre(MeasuredPoint::axis));
  EXPECT_EQ(of_table.captures_without_position, 2U);
  const KnownPositions all =
      collect_known_captures(frames, table, Eigen::Vector2d(5, 6), MeasuredPoint::camera);
  ASSERT_EQ(all.captures.size(), 3U);
  EXPECT_EQ(all.captures[1].reference_point_m, Eigen::Vector2d(5, 6));
  EXPECT_THAT(all.measured_points,
              ElementsAre(MeasuredPoint::axis, MeasuredPoint::camera, MeasuredPoint::camera));
  EXPECT_EQ(all.captures_without_position, 0U);
}

SyntheticRig make_rig_with_tilted_camera() {
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {}, {}};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.02, 1);
  return rig;
}

TEST(RunDispersionStep, WarnsOfThreeCapturesWithoutStatedNoise) {
  SyntheticRig rig = make_rig_with_tilted_camera();
  Random random(3);
  const auto list_warnings = [&](int captures, bool is_noise_stated) {
    KnownPositions known;
    for (int i = 0; i < captures; ++i) {
      rig.camera = {{0, 0, 0}, 2 * std::numbers::pi * i / captures};
      auto detections = with_noise(seen_from(rig, 0.05), random);
      if (!is_noise_stated) {
        for (Detection& detection : detections) detection.sigma_px.reset();
      }
      known.captures.push_back({detections, {0, 0}});
      known.measured_points.push_back(MeasuredPoint::camera);
    }
    const DispersionResult result =
        run_dispersion_step({{}, rig.map, "lamps.yaml", rig.calibration}, known,
                            DispersionMethod::camera, DispersionCircle::mean, {});
    EXPECT_TRUE(result.has_succeeded()) << result.message;
    return result.warnings;
  };
  const auto few = HasSubstr("three captures barely determine their noise");
  EXPECT_THAT(list_warnings(3, false), Contains(few));
  EXPECT_THAT(list_warnings(4, false), Not(Contains(few)));
  EXPECT_THAT(list_warnings(3, true), Not(Contains(few)));
}

/// Eight captures at the origin, with yaws over the full turn. `offset_px` displaces all pixels.
KnownPositions take_captures_at_origin(SyntheticRig rig, const Eigen::Vector2d& offset_px) {
  KnownPositions known;
  for (int i = 0; i < 8; ++i) {
    rig.camera = {{0, 0, 0}, 0.25 * std::numbers::pi * i};
    auto detections = seen_from(rig, 0.05);
    for (Detection& detection : detections) detection.pixel += offset_px;
    known.captures.push_back({detections, {0, 0}});
    known.measured_points.push_back(MeasuredPoint::camera);
  }
  return known;
}

DispersionResult run_step(const SyntheticRig& rig, const KnownPositions& known) {
  return run_dispersion_step({{}, rig.map, "lamps.yaml", rig.calibration}, known,
                             DispersionMethod::camera, DispersionCircle::mean,
                             {"", "test", "1.2", "", {}});
}

TEST(RunDispersionStep, ReplacesEarlierDispersion) {
  SyntheticRig rig = make_rig_with_tilted_camera();
  const KnownPositions known = take_captures_at_origin(rig, {0.4, -0.3});
  const DispersionResult once = run_step(rig, known);
  ASSERT_TRUE(once.has_succeeded()) << once.message;
  ASSERT_TRUE(once.calibration.dispersion);
  rig.calibration = once.calibration;
  const DispersionResult twice = run_step(rig, known);
  ASSERT_TRUE(twice.has_succeeded()) << twice.message;
  EXPECT_EQ(twice.calibration.dispersion->offset_px, once.calibration.dispersion->offset_px);
}

TEST(RunDispersionStep, MetricsAreRadiusAndLengthOfOffset) {
  const SyntheticRig rig = make_rig_with_tilted_camera();
  const DispersionResult result = run_step(rig, take_captures_at_origin(rig, {0.4, -0.3}));
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, testing::IsEmpty());
  const auto offset_px = find_metric_value(result.metrics, "dispersion_offset_px");
  const auto radius_mm = find_metric_value(result.metrics, "dispersion_mm");
  const auto world_mm = find_metric_value(result.metrics, "world_offset_mm");
  ASSERT_TRUE(offset_px && radius_mm && world_mm);
  EXPECT_NEAR(*offset_px, 0.5, 0.05) << "a displacement of the image, up to the lens distortion";
  EXPECT_NEAR(*radius_mm, 1e3 * result.fit.dispersion.radius_m, 1e-9);
  // Lamps are 1.6 m above the camera: a displacement of 0.5 px moves fixes by 1.6 m 0.5 px / f.
  EXPECT_NEAR(*radius_mm, 1600 * 0.5 / rig.calibration.camera.focal_px().x(), 0.3);
  EXPECT_NEAR(*world_mm, 0, 0.1);
  ASSERT_EQ(result.calibration.history.size(), 1U);
  EXPECT_EQ(result.calibration.history[0].part, "dispersion");
  EXPECT_TRUE(result.drawing);
}

TEST(RunDispersionStep, WarnsIfCalibrationHasNoRotationCenter) {
  const auto warning = HasSubstr("the calibration has no rotation_center: run vlp-rotation first");
  SyntheticRig rig{synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {}, {}};
  const KnownPositions known = take_captures_at_origin(rig, {0.1, 0});
  const DispersionResult without = run_step(rig, known);
  ASSERT_TRUE(without.has_succeeded()) << without.message;
  EXPECT_THAT(without.warnings, ElementsAre(warning));
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0, 0);
  EXPECT_THAT(run_step(rig, known).warnings, testing::IsEmpty());
}

TEST(RunDispersionStep, FailsForPositionsOfAxisWithoutLeverArm) {
  const SyntheticRig rig = make_rig_with_tilted_camera();
  KnownPositions known = take_captures_at_origin(rig, {0, 0});
  known.measured_points[3] = MeasuredPoint::axis;
  const DispersionResult result = run_step(rig, known);
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_THAT(result.message, HasSubstr("the positions are those of the axis, and the calibration "
                                        "has no lever arm"));
}

TEST(RunDispersionStep, FailsForCapturesFarFromPosition) {
  const SyntheticRig rig = make_rig_with_tilted_camera();
  KnownPositions known = take_captures_at_origin(rig, {0, 0});
  for (ReferencePointCapture& capture : known.captures) capture.reference_point_m.x() += 1;
  const DispersionResult result = run_step(rig, known);
  EXPECT_EQ(result.failure, StepFailure::wrong_place);
  EXPECT_FALSE(result.calibration.dispersion);
}

TEST(CheckKnownPositions, FailsIfFewerThanRequiredAreKnown) {
  EXPECT_THAT(check_known_positions(35, 36, 36).message, HasSubstr("1 of the 36 captures"));
  EXPECT_TRUE(check_known_positions(35, 36, 35).has_succeeded());
  EXPECT_TRUE(check_known_positions(20, 20, 36).has_succeeded()) << "all of them";
  EXPECT_EQ(check_known_positions(0, 0, 1).failure, StepFailure::wrong_place);
}

TEST(RunDispersionStep, FailureMessageNamesStatusOfFirstFix) {
  const SyntheticRig rig = make_rig_with_tilted_camera();
  KnownPositions known = take_captures_at_origin(rig, {0, 0});
  for (ReferencePointCapture& capture : known.captures) capture.detections.resize(1);
  const DispersionResult result = run_step(rig, known);
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_THAT(
      result.message,
      HasSubstr("; the first: " + std::string(describe_fix_status(FixStatus::too_few_lamps))));
}

TEST(RunDispersionStep, EnclosingCircleOfAxisPositionsHasNoCovariance) {
  SyntheticRig rig = make_rig_with_tilted_camera();
  rig.calibration.rotation_center->lever_arm_m = Eigen::Vector2d(0, 0);
  KnownPositions known = take_captures_at_origin(rig, {0.1, 0});
  const ReferencePointCapture first = known.captures.front();
  known.captures.assign(3, first);  // at one yaw, as the circle requires
  known.measured_points.assign(3, MeasuredPoint::axis);
  for (const auto& [circle, has_covariance] :
       {std::pair(DispersionCircle::enclosing, false), {DispersionCircle::mean, true}}) {
    const DispersionResult result =
        run_dispersion_step({{}, rig.map, "lamps.yaml", rig.calibration}, known,
                            DispersionMethod::chen_guan, circle, {});
    ASSERT_TRUE(result.has_succeeded()) << result.message;
    EXPECT_EQ(result.calibration.covariance.has_value(), has_covariance);
  }
}

TEST(RunDispersionStep, OffsetIncludesLeverArmErrorsForAxisPositionsOnly) {
  for (const MeasuredPoint point : {MeasuredPoint::camera, MeasuredPoint::axis}) {
    SyntheticRig rig = make_rig_with_tilted_camera();
    KnownPositions known = take_captures_at_origin(rig, {0, 0});
    known.measured_points.assign(8, point);
    const auto run_with_arm = [&](const Eigen::Vector2d& lever_arm_m) {
      rig.calibration.rotation_center->lever_arm_m = lever_arm_m;
      DispersionResult result = run_step(rig, known);
      EXPECT_TRUE(result.has_succeeded()) << result.message;
      return result;
    };
    const auto find_covariance = [&] {
      const auto covariance = compute_offset_covariance(run_with_arm({0, 0}).calibration);
      EXPECT_TRUE(covariance);
      return covariance.value_or(Matrix2::Zero());
    };
    const Matrix2 without = find_covariance();
    const Eigen::Vector2d arm_sd_m(1e-3, 2e-3);
    append_parameters(rig.calibration.covariance.emplace(), list_pair_names(kLeverArmParameter),
                      MatrixX(2, 0), arm_sd_m.cwiseAbs2().asDiagonal().toDenseMatrix());
    const Matrix2 added = find_covariance() - without;
    Eigen::Matrix2d changes_px;
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d arm_m = arm_sd_m[axis] * Eigen::Vector2d::Unit(axis);
      changes_px.col(axis) = run_with_arm(arm_m).fit.dispersion.offset_px -
                             run_with_arm({0, 0}).fit.dispersion.offset_px;
    }
    EXPECT_EQ(changes_px.norm() > 0.1, point == MeasuredPoint::axis);
    EXPECT_THAT(added, IsNear(Matrix2(changes_px * changes_px.transpose()), 1e-3));
  }
}

TEST(RunDispersionStep, FailureMessageDoesNotBlameMovedLampForSingleYaw) {
  SyntheticRig rig = make_rig_with_tilted_camera();
  const LampMap map = rig.map;
  rig.map.lamps[1].position_m.x() += 0.01;
  KnownPositions known;
  LampCaptures input{{}, map, "lamps.yaml", rig.calibration};
  for (int i = 0; i < 12; ++i) {
    rig.camera = {{0.05 * (i % 4), 0.05 * (i % 3), 0}, 0.5};
    known.captures.push_back({seen_from(rig, 0.05), rig.camera.position_m.head<2>()});
    known.measured_points.push_back(MeasuredPoint::camera);
    input.frames.push_back({std::to_string(i), known.captures.back().detections});
  }
  const DispersionResult result =
      run_dispersion_step(input, known, DispersionMethod::camera, DispersionCircle::mean, {});
  EXPECT_EQ(result.failure, StepFailure::undetermined) << result.message;
  EXPECT_THAT(result.message, Not(HasSubstr("lamp 2")));
}

/// Positions of the rotation axis, stated as camera positions; the lever arm is 20 mm.
TEST(RunDispersionStep, WarnsIfOffsetEqualsLeverArm) {
  SyntheticRig rig = make_rig_with_tilted_camera();
  KnownPositions known;
  for (int i = 0; i < 8; ++i) {
    const double yaw_rad = 0.25 * std::numbers::pi * i;
    rig.camera = {rotation_about_z(yaw_rad) * Eigen::Vector3d(0.016, -0.012, 0), yaw_rad};
    known.captures.push_back({seen_from(rig, 0.05), {0, 0}});
    known.measured_points.push_back(MeasuredPoint::camera);
  }
  const auto warning = HasSubstr("the offset equals the lever arm, ");
  EXPECT_THAT(run_step(rig, known).warnings, Not(Contains(warning))) << "lever arm is unknown";
  rig.calibration.rotation_center->lever_arm_m = Eigen::Vector2d(0.016, -0.012);
  EXPECT_THAT(run_step(rig, known).warnings,
              ElementsAre(HasSubstr("the offset equals the lever arm, 20.0 mm: the positions are "
                                    "those of the axis, and fixes would have an error of ")));
  rig.calibration.rotation_center->lever_arm_m = Eigen::Vector2d(-0.016, 0.012);
  EXPECT_THAT(run_step(rig, known).warnings, Not(Contains(warning))) << "opposite direction";
  rig.calibration.rotation_center->lever_arm_m = Eigen::Vector2d(0.024, -0.018);
  EXPECT_THAT(run_step(rig, known).warnings, Not(Contains(warning))) << "another length";
}

}  // namespace
}  // namespace vlp
