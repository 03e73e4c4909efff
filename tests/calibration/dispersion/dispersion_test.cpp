// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/dispersion.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "calibration/dispersion/station.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "support/matchers.h"

namespace vlp {
namespace {

TEST(EstimateDispersion, CameraMethodRecoversWorldOffsetAndCorrectsFixesExactly) {
  Random random(1);
  for (const double error_rad : {0.0, 0.005, 0.05}) {
    Station station(error_rad);
    const Eigen::Vector2d wrong_m(0.004, -0.003);
    const auto captures = station.captures(12, true, wrong_m);
    const auto fit =
        estimate_dispersion(captures, station.rig.map, station.believed, DispersionMethod::camera);
    ASSERT_EQ(fit.status, DispersionStatus::ok) << describe_status(fit.status);
    ASSERT_TRUE(fit.world_offset_m);
    EXPECT_THAT(*fit.world_offset_m, IsNear(wrong_m, 1e-9));
    EXPECT_LT(fit.after.radius, 1e-9);
    EXPECT_TRUE(error_rad == 0 || fit.before.radius > 0.005);
    EXPECT_EQ(fit.dispersion.captures, 12);
    EXPECT_EQ(fit.dispersion.radius_m, fit.before.radius);

    Calibration corrected = station.believed;
    corrected.dispersion = fit.dispersion;
    const Positioner positioner(station.rig.map, corrected);
    for (int i = 0; i < 20; ++i) {  // other positions, heights and yaws
      station.rig.camera = {{random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3), 0.02 * i},
                            random.uniform(-3, 3)};
      const Fix fix = positioner.compute_position_fix(seen_from(station.rig));
      ASSERT_TRUE(fix.has_succeeded());
      EXPECT_THAT(fix.state.pose.position_m, IsNear(station.rig.camera.position_m, 1e-8));
    }
  }
}

TEST(EstimateDispersion, CameraMethodReturnsPrincipalPointErrorWithoutRotationCenter) {
  Station station(0);
  station.believed.rotation_center.reset();
  station.rig.calibration.rotation_center.reset();
  station.rig.calibration.dispersion = vlp::Dispersion{{6, -4}, 0, {0, 0}, 1};
  const auto captures = station.captures(12, true, {0, 0});
  const auto fit =
      estimate_dispersion(captures, station.rig.map, station.believed, DispersionMethod::camera);
  ASSERT_EQ(fit.status, DispersionStatus::ok);
  EXPECT_THAT(fit.dispersion.offset_px, IsNear(Eigen::Vector2d(6, -4), 1e-6));
  const double radius_m = 1.6 * std::hypot(6 / 520., 4 / 522.);
  EXPECT_NEAR(fit.before.radius, radius_m, 0.01 * radius_m) << "a full turn draws the circle";
}

/// The paper's equations are exact for a shift and lamps of one height, at any yaw.
TEST(EstimateDispersion, ChenGuanMethodReturnsTrueOffsetAtOneYaw) {
  for (const DispersionCircle circle : {DispersionCircle::mean, DispersionCircle::enclosing}) {
    Station station(0);
    station.believed.rotation_center.reset();
    station.rig.calibration.rotation_center.reset();
    station.rig.calibration.dispersion = vlp::Dispersion{{6, -4}, 0, {0, 0}, 1};
    for (const double yaw_rad : {0.0, 2.0, -1.0}) {
      const auto captures = station.captures_at(yaw_rad, 5);
      const auto fit = estimate_dispersion(captures, station.rig.map, station.believed,
                                           DispersionMethod::chen_guan, circle);
      ASSERT_EQ(fit.status, DispersionStatus::ok);
      EXPECT_FALSE(fit.world_offset_m.has_value());
      // Fixes of many lamps have weights by the lens, which depend on the shift.
      EXPECT_THAT(fit.dispersion.offset_px, IsNear(Eigen::Vector2d(6, -4), 0.01));
      EXPECT_LT(fit.after.center.norm(), 1e-9);
    }
  }
}

/// After a rotation center of model `tilt` the offset is applied as a rotation. The factor f / H
/// and the yaw alone would leave 10 % of 16 mm.
TEST(EstimateDispersion, ChenGuanMethodCentersFixesAtReferencePointIfCameraIsTilted) {
  for (const DispersionCircle circle : {DispersionCircle::mean, DispersionCircle::enclosing}) {
    Station station(0.01);
    Random random(3);
    for (const double yaw_rad : {0.0, 2.0, -1.0}) {
      auto captures = station.captures_at(yaw_rad, 6);
      for (auto& capture : captures) capture.detections = with_noise(capture.detections, random);
      const auto fit = estimate_dispersion(captures, station.rig.map, station.believed,
                                           DispersionMethod::chen_guan, circle);
      ASSERT_EQ(fit.status, DispersionStatus::ok);
      EXPECT_GT(fit.before.center.norm(), 0.01);
      EXPECT_LT(fit.after.center.norm(), 1e-9);
    }
  }
}

TEST(EstimateDispersion, ChenGuanMethodAttributesReferencePointErrorToCamera) {
  Station station(0);
  station.believed.rotation_center.reset();
  station.rig.calibration.rotation_center.reset();
  for (const auto& [yaw_rad, sign] : {std::pair(0.0, 1.0), std::pair(M_PI, -1.0)}) {
    auto captures = station.captures_at(yaw_rad, 5);
    for (auto& capture : captures) capture.reference_point_m.x() -= 0.008;
    const auto fit = estimate_dispersion(captures, station.rig.map, station.believed,
                                         DispersionMethod::chen_guan);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    EXPECT_NEAR(fit.dispersion.offset_px.x(), -sign * 520 * 0.008 / 1.6, 0.01);
  }
}

TEST(EstimateDispersion, RejectsQuarterOfCapturesWithReferencePointErrors) {
  Station station(0.01);
  Random random(2);
  for (const auto method : {DispersionMethod::camera, DispersionMethod::chen_guan}) {
    auto captures = method == DispersionMethod::camera ? station.captures(40, true, {0, 0})
                                                       : station.captures_at(0.5, 40);
    const auto clean = estimate_dispersion(captures, station.rig.map, station.believed, method);
    ASSERT_EQ(clean.status, DispersionStatus::ok);
    for (std::size_t i = 0; i < 40; ++i) {
      captures[i].detections = with_noise(captures[i].detections, random);
      if (i % 4 == 0)
        captures[i].reference_point_m += Eigen::Vector2d(0.05 + 5e-4 * double(i), -0.05);
    }
    const auto fit = estimate_dispersion(captures, station.rig.map, station.believed, method);
    ASSERT_EQ(fit.status, DispersionStatus::ok);
    ASSERT_TRUE(fit.covariance);
    EXPECT_EQ(fit.dispersion.captures, 30);
    const Eigen::Vector2d error = fit.dispersion.offset_px - clean.dispersion.offset_px;
    EXPECT_LT(error.dot(fit.covariance->inverse() * error), 20);
  }
}

TEST(EstimateDispersion, ReducesFixCircleToZeroWithInclinationSensor) {
  Station station(0.01);
  station.rig.inclination = Inclination{0.04, -0.03};
  auto captures = station.captures(12, true, {0, 0});
  for (auto& capture : captures) capture.inclination = station.rig.inclination;
  const auto fit =
      estimate_dispersion(captures, station.rig.map, station.believed, DispersionMethod::camera);
  ASSERT_EQ(fit.status, DispersionStatus::ok);
  EXPECT_LT(fit.after.radius, 1e-9);
}

TEST(EstimateDispersion, ReturnsStatusOfEachUnusableSetOfCaptures) {
  Station station(0.01);
  const auto find_status = [&](const std::vector<ReferencePointCapture>& captures,
                               DispersionMethod method = DispersionMethod::camera) {
    return estimate_dispersion(captures, station.rig.map, station.believed, method).status;
  };
  const auto turned = station.captures(12, true, {0, 0});
  EXPECT_EQ(find_status({}), DispersionStatus::no_fix);
  EXPECT_EQ(find_status({turned[0], turned[4]}), DispersionStatus::too_few_captures);
  EXPECT_EQ(find_status({turned[0], turned[4], turned[8]}), DispersionStatus::ok);
  EXPECT_EQ(find_status({turned[0], turned[4], {{}, {0, 0}}}), DispersionStatus::too_few_captures);
  EXPECT_EQ(find_status({turned[0]}, DispersionMethod::chen_guan),
            DispersionStatus::too_few_captures);
  EXPECT_EQ(find_status({turned[0], turned[0]}, DispersionMethod::chen_guan), DispersionStatus::ok);
  EXPECT_EQ(find_status(turned, DispersionMethod::chen_guan), DispersionStatus::several_yaws);
  EXPECT_EQ(find_status(station.captures_at(1, 20)), DispersionStatus::single_yaw);
  // A single capture at another yaw, with an error, must not decide.
  auto one_other = station.captures_at(1, 12);
  one_other.push_back(station.captures_at(2.5, 1)[0]);
  one_other.back().reference_point_m.x() += 0.05;
  EXPECT_EQ(find_status(one_other), DispersionStatus::single_yaw);
  // Captures between 18 and 22 degrees apart vary by 9 and 11 degrees about their mean.
  for (const double apart_deg : {18., 22.}) {
    auto pair = station.captures_at(1, 6);
    for (const auto& other : station.captures_at(1 + rad_from_deg(apart_deg), 6))
      pair.push_back(other);
    EXPECT_EQ(find_status(pair) == DispersionStatus::single_yaw, apart_deg < 20);
    EXPECT_EQ(find_status(pair, DispersionMethod::chen_guan) == DispersionStatus::several_yaws,
              apart_deg > 20);
  }
  auto far = turned;
  for (auto& capture : far) capture.reference_point_m.x() += 1;
  EXPECT_EQ(find_status(far), DispersionStatus::all_far_from_reference);
  auto other_map = turned;
  for (auto& capture : other_map) {
    for (auto& detection : capture.detections) detection.lamp += 50;
  }
  const auto fit =
      estimate_dispersion(other_map, station.rig.map, station.believed, DispersionMethod::camera);
  EXPECT_EQ(fit.status, DispersionStatus::no_fix);
  EXPECT_EQ(fit.captures_without_fix, 12);
  EXPECT_EQ(fit.no_fix_status, FixStatus::too_few_lamps);
}

}  // namespace
}  // namespace vlp
