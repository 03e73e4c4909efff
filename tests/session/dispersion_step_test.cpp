// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/dispersion_step.h"

#include <gmock/gmock.h>

#include <numbers>

#include "support/body_rig.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(CollectCapturesAtKnownPositions, TakesPositionsOfTableElseGivenPosition) {
  const std::vector<Frame> frames{{"both", {}}, {"only x", {}}, {"not in table", {}}};
  CapturesTable table;
  table["both"].x_m = 1;
  table["both"].y_m = 2;
  table["both"].measured_point = MeasuredPoint::axis;
  table["both"].inclination = Inclination{0.1, 0.2};
  table["only x"].x_m = 3;
  const KnownPositions of_table = collect_captures_at_known_positions(frames, table);
  ASSERT_EQ(of_table.captures.size(), 1U);
  EXPECT_EQ(of_table.captures[0].reference_point_m, Eigen::Vector2d(1, 2));
  ASSERT_TRUE(of_table.captures[0].inclination);
  EXPECT_EQ(of_table.captures[0].inclination->pitch_rad, 0.2);
  EXPECT_THAT(of_table.measured_points, ElementsAre(MeasuredPoint::axis));
  EXPECT_EQ(of_table.captures_without_position, 2U);
  const KnownPositions all = collect_captures_at_known_positions(
      frames, table, Eigen::Vector2d(5, 6), MeasuredPoint::camera);
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

TEST(RunDispersionCalibrationStep, WarnsOfThreeCapturesWithoutStatedNoise) {
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
        run_dispersion_calibration_step({{}, rig.map, "lamps.yaml", rig.calibration}, known,
                                        DispersionMethod::camera, DispersionCircle::mean, {});
    EXPECT_TRUE(result.has_succeeded()) << result.message;
    return result.warnings;
  };
  const auto few = HasSubstr("three captures barely determine their noise");
  EXPECT_THAT(list_warnings(3, false), Contains(few));
  EXPECT_THAT(list_warnings(4, false), Not(Contains(few)));
  EXPECT_THAT(list_warnings(3, true), Not(Contains(few)));
}

TEST(RunDispersionCalibrationStep, ReplacesEarlierDispersion) {
  SyntheticRig rig = make_rig_with_tilted_camera();
  KnownPositions known;
  for (int i = 0; i < 8; ++i) {
    rig.camera = {{0, 0, 0}, 0.25 * std::numbers::pi * i};
    auto detections = seen_from(rig, 0.05);
    for (Detection& detection : detections) detection.pixel += Eigen::Vector2d(0.4, -0.3);
    known.captures.push_back({detections, {0, 0}});
    known.measured_points.push_back(MeasuredPoint::camera);
  }
  const auto run = [&](const Calibration& calibration) {
    return run_dispersion_calibration_step({{}, rig.map, "lamps.yaml", calibration}, known,
                                           DispersionMethod::camera, DispersionCircle::mean, {});
  };
  const DispersionResult once = run(rig.calibration);
  ASSERT_TRUE(once.has_succeeded()) << once.message;
  ASSERT_TRUE(once.calibration.dispersion);
  EXPECT_GT(once.calibration.dispersion->offset_px.norm(), 0.4);
  const DispersionResult twice = run(once.calibration);
  ASSERT_TRUE(twice.has_succeeded()) << twice.message;
  EXPECT_EQ(twice.calibration.dispersion->offset_px, once.calibration.dispersion->offset_px);
}

/// Captures with a stated inclination at a known position of the axis.
TEST(RunDispersionCalibrationStep, UsesInclinationToMovePlacesOfAxis) {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.02, 1);
  rig.calibration.rotation_center->lever_arm_m = Eigen::Vector2d(0.02, 0);
  const Inclination inclination{0.15, -0.1};
  rig.body.motion.inclination = inclination;
  KnownPositions known;
  for (int i = 0; i < 8; ++i) {
    const double yaw_rad = 0.25 * std::numbers::pi * i;
    rig.body.pose = {rotation_about_z(yaw_rad) * Eigen::Vector3d(0.02, 0, 0), yaw_rad};
    known.captures.push_back({seen_from(rig, 0.05), {0, 0}, inclination});
    known.measured_points.push_back(MeasuredPoint::axis);
  }
  const DispersionResult result =
      run_dispersion_calibration_step({{}, rig.map, "lamps.yaml", rig.calibration}, known,
                                      DispersionMethod::camera, DispersionCircle::mean, {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_LT(result.fit.dispersion.offset_px.norm(), 1e-4);
}

}  // namespace
}  // namespace vlp
