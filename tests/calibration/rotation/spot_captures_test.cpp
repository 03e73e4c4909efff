// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/spot_captures.h"

#include <gmock/gmock.h>

#include <cmath>

#include "calibration/rotation/spot.h"
#include "calibration/rotation/turning_axis.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "support/near.h"

namespace vlp {
namespace {

SpotStatus status_of(const SpotScene& scene, const std::vector<Frame>& frames) {
  return spot_captures(frames, scene.map, scene.camera).status;
}
SpotStatus status_of(const SpotScene& scene) { return status_of(scene, scene.frames()); }

SpotScene tilted_scene() {
  SpotScene scene;
  scene.tilt_rad = rad_from_deg(1.5);
  scene.lever_arm_m = {0.012, -0.009};
  scene.heights_m = {0, 0.3};
  return scene;
}

RotationFit fit(const SpotScene& scene, const std::vector<Frame>& frames) {
  const SpotCaptures spot = spot_captures(frames, scene.map, scene.camera);
  EXPECT_EQ(spot.status, SpotStatus::ok) << explanation_of(spot.status);
  return spot.status == SpotStatus::ok ? fit_turning_axis(spot, scene.camera) : RotationFit();
}

void expect_axis(const RotationFit& found, const SpotScene& scene, double within_deg) {
  ASSERT_TRUE(found.converged);
  EXPECT_LT(
      deg_from_rad(angle_between(found.center.zenith_in_camera, scene.truth().zenith_in_camera)),
      within_deg);
}

TEST(SpotCaptures, TellsHeightsYawsAndAxes) {
  const SpotScene scene = tilted_scene();
  const SpotCaptures spot = spot_captures(scene.frames(), scene.map, scene.camera);
  ASSERT_EQ(spot.status, SpotStatus::ok);
  ASSERT_EQ(spot.captures.size(), 24U);
  ASSERT_EQ(spot.heights.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(spot.heights[i].z_m, scene.heights_m[i], 1e-3);
    EXPECT_THAT(spot.heights[i].axis_m, IsNear(scene.axis_m, 1e-3));
    EXPECT_EQ(spot.heights[i].captures, 12);
    EXPECT_GT(deg_from_rad(spot.heights[i].arc_rad), 300);
  }
  EXPECT_EQ(spot.captures[0].height, 0U);
  EXPECT_EQ(spot.captures[23].height, 1U);
  EXPECT_NEAR(spot.captures[0].yaw_rad, scene.first_rad, 1e-3);
  EXPECT_THAT(spot.lever_arm_m, IsNear(scene.lever_arm_m, 1e-4));
  EXPECT_TRUE(spot.left_out.empty());
}

TEST(SpotCaptures, TakesTwoLampsAndThreeCaptures) {
  SpotScene scene;
  scene.tilt_rad = rad_from_deg(10);
  scene.map = lamp_map_of({{-0.3, -0.35, 1.6}, {0.5, 0.2, 1.6}});
  scene.captures = 3;
  scene.arc_rad = 4;
  expect_axis(fit(scene, scene.frames()), scene, 1e-6);
}

TEST(SpotCaptures, TakesLampsAtSeveralHeights) {
  SpotScene scene = tilted_scene();
  scene.map =
      lamp_map_of({{-0.5, -0.35, 1.6}, {0.5, 0.2, 1.4}, {-0.4, 0.3, 1.8}, {0.1, -0.4, 1.5}});
  expect_axis(fit(scene, scene.frames()), scene, 1e-6);
}

TEST(SpotCaptures, TakesAQuarterTurn) {
  SpotScene scene = tilted_scene();
  scene.arc_rad = rad_from_deg(105);  // less what unevenness takes at the ends
  expect_axis(fit(scene, scene.frames()), scene, 1e-6);
}

TEST(SpotCaptures, RefusesTooSmallAnArc) {
  SpotScene scene;
  scene.arc_rad = rad_from_deg(80);
  EXPECT_EQ(status_of(scene), SpotStatus::short_arc);
}

TEST(SpotCaptures, RefusesCapturesThatAreAlike) {
  SpotScene scene;
  scene.arc_rad = 1e-3;
  EXPECT_EQ(status_of(scene), SpotStatus::alike);
  Random random(3);
  EXPECT_EQ(status_of(scene, with_noise(scene.frames(0.3), random)), SpotStatus::alike);
}

TEST(SpotCaptures, RefusesTooFewCaptures) {
  SpotScene scene;
  for (const int captures : {1, 2}) {
    scene.captures = captures;
    EXPECT_EQ(status_of(scene), SpotStatus::too_few_captures) << captures;
  }
  EXPECT_EQ(status_of(scene, {}), SpotStatus::other_map);
}

TEST(SpotCaptures, RefusesOneLamp) {
  SpotScene scene;
  auto frames = scene.frames();
  for (Frame& frame : frames) {
    std::erase_if(frame.detections, [](const Detection& one) { return one.lamp != 7; });
  }
  EXPECT_EQ(status_of(scene, frames), SpotStatus::too_few_lamps);
  scene.map.lamps.resize(1);
  EXPECT_EQ(status_of(scene), SpotStatus::too_few_lamps);
  // Two in all, but never two at a time.
  SpotScene in_turn;
  frames = in_turn.frames();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::erase_if(frames[i].detections,
                  [&](const Detection& one) { return one.lamp != (i % 2 == 0 ? 7 : 8); });
  }
  EXPECT_EQ(status_of(in_turn, frames), SpotStatus::too_few_lamps);
}

TEST(SpotCaptures, RefusesTheLampsOfAnotherMap) {
  SpotScene scene;
  const auto frames = scene.frames();
  for (Lamp& lamp : scene.map.lamps) lamp.id += 100;
  EXPECT_EQ(status_of(scene, frames), SpotStatus::other_map);
  scene = {};
  for (Lamp& lamp : scene.map.lamps) lamp.position_m.x() *= -1;  // as seen from below
  EXPECT_EQ(status_of(scene, frames), SpotStatus::other_map);
  scene = {};
  std::swap(scene.map.lamps[1].position_m, scene.map.lamps[6].position_m);
  std::swap(scene.map.lamps[0].position_m, scene.map.lamps[5].position_m);
  std::swap(scene.map.lamps[2].position_m, scene.map.lamps[4].position_m);
  EXPECT_EQ(status_of(scene, frames), SpotStatus::other_map);
}

TEST(SpotCaptures, RefusesADrive) {
  SpotScene scene;
  std::vector<Frame> frames;
  for (int k = 0; k < 12; ++k) {
    scene.axis_m = {-0.3 + 0.05 * k, 0.1 * (k % 3)};
    frames.push_back(scene.frames()[static_cast<std::size_t>(k)]);
  }
  EXPECT_EQ(status_of(scene, frames), SpotStatus::moved);
}

TEST(SpotCaptures, LeavesOutAHeightWithTooFewCapturesAndSaysSo) {
  const SpotScene scene = tilted_scene();
  auto frames = scene.frames();
  frames.resize(14);
  const SpotCaptures spot = spot_captures(frames, scene.map, scene.camera);
  ASSERT_EQ(spot.status, SpotStatus::ok);
  EXPECT_EQ(spot.heights.size(), 1U);
  ASSERT_EQ(spot.left_out.size(), 2U);
  EXPECT_EQ(spot.left_out[1].image, "13.png");
}

/// A third of the captures with a lamp far off and the noise of a poor detector.
TEST(SpotCaptures, OutliersAreFoundAndChangeLittle) {
  const SpotScene scene = tilted_scene();
  Random random(5);
  auto frames = with_noise(scene.frames(0.05), random);
  std::vector<std::pair<std::string, int>> wrong;
  for (std::size_t i = 0; i < frames.size(); i += 3) {
    Detection& one = frames[i].detections[i % frames[i].detections.size()];
    one.pixel += Eigen::Vector2d(random.uniform(2, 60), random.uniform(-60, -2));
    wrong.emplace_back(frames[i].image, one.lamp);
  }
  const SpotCaptures spot = spot_captures(frames, scene.map, scene.camera);
  ASSERT_EQ(spot.status, SpotStatus::ok);
  EXPECT_TRUE(spot.left_out.empty());
  const RotationFit found = fit_turning_axis(spot, scene.camera);
  expect_axis(found, scene, 0.01);
  std::vector<std::pair<std::string, int>> named;
  for (const auto& outlier : found.outliers) {
    const SpotSighting& sighting = spot.sightings[outlier.sighting];
    named.emplace_back(spot.captures[sighting.capture].image, spot.lamps[sighting.lamp].id);
  }
  EXPECT_THAT(named, testing::IsSupersetOf(wrong));
  EXPECT_LE(named.size(), wrong.size() + 1);
}

TEST(SpotCaptures, AMisidentifiedLampAmongTwoCostsItsCapture) {
  SpotScene scene;
  scene.tilt_rad = rad_from_deg(1.5);
  scene.map = lamp_map_of({{-0.3, -0.35, 1.6}, {0.5, 0.2, 1.6}, {0.1, 0.4, 1.6}});
  auto frames = scene.frames();
  for (Frame& frame : frames) frame.detections.resize(2);
  frames[4].detections[1].lamp = 3;
  const SpotCaptures spot = spot_captures(frames, scene.map, scene.camera);
  ASSERT_EQ(spot.status, SpotStatus::ok);
  ASSERT_EQ(spot.left_out.size(), 1U);
  EXPECT_EQ(spot.left_out[0].image, "4.png");
  expect_axis(fit_turning_axis(spot, scene.camera), scene, 1e-6);
}

/// The heights are the map's, the places on the ceiling are not trusted.
TEST(SpotCaptures, ErrorsOfTheMapAlongTheCeilingDoNotMatter) {
  SpotScene scene = tilted_scene();
  scene.arc_rad = 2.5;
  const auto frames = scene.frames();
  Random random(6);
  for (Lamp& lamp : scene.map.lamps) {
    lamp.position_m.head<2>() +=
        Eigen::Vector2d(random.uniform(-5e-3, 5e-3), random.uniform(-5e-3, 5e-3));
  }
  expect_axis(fit(scene, frames), scene, 0.01);
}

/// What the axis at one height is good for, with a lever arm: fixes of the axis at that height.
TEST(SpotCaptures, AtOneHeightFixesAreOfTheAxis) {
  SpotScene scene = tilted_scene();
  scene.heights_m = {0};
  const RotationFit found = fit(scene, scene.frames());
  ASSERT_TRUE(found.converged);
  Calibration calibration;
  calibration.camera = scene.camera;
  calibration.rotation_center = found.center;
  const Positioner positioner(scene.map, calibration);
  for (const Frame& frame : scene.frames()) {
    const Fix fix = positioner.locate(frame.detections);
    ASSERT_TRUE(fix.ok());
    const Eigen::Vector2d place_m = fix.estimate.pose.position_m.head<2>();
    EXPECT_THAT(place_m, IsNear(scene.axis_m, 0.1 * scene.lever_arm_m.norm()));
  }
}

}  // namespace
}  // namespace vlp
