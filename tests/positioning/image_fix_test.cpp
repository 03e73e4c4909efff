// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/image_fix.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "geometry/angles.h"
#include "support/body_rig.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Camera tilted by 20 degrees. Errors of lamp centers: 40 px per radian of the angle error of the
/// detection plane, or 2 px for ellipses in place of discs.
class LocateWithRepeatedDetection : public testing::Test {
 protected:
  void SetUp() override { rig_.body.motion.inclination = tilt_; }

  /// First detection in the plane of the reading, or of a level camera.
  ImageFix locate(const Sensors& sensors) {
    const Positioner positioner = rig_.positioner();
    return locate_with_repeated_detection(
        positioner, sensors,
        detect_in(
            positioner.compute_level_from_camera(sensors.inclination.value_or(Inclination{0, 0}))),
        [this](const std::optional<Eigen::Matrix3d>& level) {
          planes.push_back(level ? deg_from_rad(compute_error_rad(*level)) : -1);
          return detect_in(level);
        });
  }
  static Sensors unknown_tilt() {
    Sensors sensors;
    sensors.inclination_sigma_rad = 1.6;
    return sensors;
  }
  static double compute_error_m(const Fix& fix) {
    return fix.has_succeeded() ? fix.state.pose.position_m.norm() : 1;
  }

  /// Error of the level direction of each repetition, degrees; -1: ellipses.
  std::vector<double> planes;
  bool have_only_ellipses_two_lamps = false, have_ellipses_one_lamp = false;

 private:
  double compute_error_rad(const Eigen::Matrix3d& level) const {
    const Eigen::Vector3d up = level_rotation_from_inclination(tilt_).row(2);
    return std::acos(std::min(1.0, up.dot(level.row(2))));
  }
  std::vector<Detection> detect_in(const std::optional<Eigen::Matrix3d>& level) const {
    std::vector<Detection> detections = seen_from(rig_, 0.05);
    const double error_px = level ? 40 * compute_error_rad(*level) : 2;
    for (Detection& one : detections)
      one.pixel += error_px * Eigen::Vector2d(one.lamp % 2, one.lamp % 3);
    if (have_only_ellipses_two_lamps) detections.resize(level ? 1 : 2);
    if (have_ellipses_one_lamp && !level) detections.resize(1);
    return detections;
  }

  Inclination tilt_{rad_from_deg(16), rad_from_deg(-12)};
  BodyRig rig_{synthetic_lamps(), rolling_calibration(), {}, {}};
};

TEST_F(LocateWithRepeatedDetection, ErrorIsBelow100MicrometersForUnknownTilt) {
  const ImageFix found = locate(unknown_tilt());
  EXPECT_LT(compute_error_m(found.fix), 1e-4);
  ASSERT_GE(planes.size(), 3U);
  EXPECT_LE(planes.size(), 7U);
  EXPECT_EQ(planes[0], -1) << "ellipses, as the tilt may be large";
  EXPECT_LT(planes.back(), 0.01);
  EXPECT_EQ(found.repetition, planes.size());
}

TEST_F(LocateWithRepeatedDetection, RepeatsDetectionUnlessInclinationIsExact) {
  Sensors sensors;
  sensors.inclination = Inclination{rad_from_deg(16), rad_from_deg(-12)};
  EXPECT_LT(compute_error_m(locate(sensors).fix), 1e-4);
  EXPECT_THAT(planes, IsEmpty());
  sensors.inclination = Inclination{rad_from_deg(15), rad_from_deg(-11)};
  sensors.inclination_sigma_rad = rad_from_deg(0.5);
  EXPECT_LT(compute_error_m(locate(sensors).fix), 1e-3);
  EXPECT_FALSE(planes.empty());
}

TEST_F(LocateWithRepeatedDetection, FitsEllipsesFirstOnlyForTiltSdAboveThreeDegrees) {
  for (const double sd_rad : {0.045, 0.055}) {
    planes.clear();
    Sensors sensors;
    sensors.inclination = Inclination{rad_from_deg(15), rad_from_deg(-11)};
    sensors.inclination_sigma_rad = sd_rad;
    EXPECT_LT(compute_error_m(locate(sensors).fix), 1e-3);
    ASSERT_FALSE(planes.empty());
    EXPECT_EQ(planes[0] == -1, sd_rad > 0.05) << sd_rad;
  }
}

TEST_F(LocateWithRepeatedDetection, ContinuesFromFirstFixIfEllipsesYieldNoFix) {
  have_ellipses_one_lamp = true;
  EXPECT_LT(compute_error_m(locate(unknown_tilt()).fix), 1e-3);
  ASSERT_GE(planes.size(), 3U);
  EXPECT_EQ(planes[0], -1);
  EXPECT_GE(planes[1], 0);
}

TEST_F(LocateWithRepeatedDetection, ReturnsDetectionsOfMostLampsIfThereIsNoFix) {
  have_only_ellipses_two_lamps = true;
  const ImageFix found = locate(unknown_tilt());
  EXPECT_THAT(planes, ElementsAre(-1));
  EXPECT_FALSE(found.fix.has_succeeded());
  EXPECT_EQ(found.detections.size(), 2U);
  EXPECT_EQ(found.repetition, 1U);
}

}  // namespace
}  // namespace vlp
