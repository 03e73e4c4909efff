// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Captures that are no rotation in place, or too small a part of one.
#include <gtest/gtest.h>

#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/spot.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

RotationStatus find_status(const RotationScene& scene, const std::vector<Frame>& frames) {
  return find_in_place_rotation_captures(frames, scene.map, scene.camera).status;
}
RotationStatus find_status(const RotationScene& scene) {
  return find_status(scene, scene.frames());
}

TEST(FindInPlaceRotationCaptures, ReturnsShortArcStatusForArcOf80Degrees) {
  RotationScene scene;
  scene.arc_rad = rad_from_deg(80);
  EXPECT_EQ(find_status(scene), RotationStatus::short_arc);
}

TEST(FindInPlaceRotationCaptures, ReturnsAlikeStatusForCapturesAtOneYaw) {
  RotationScene scene;
  scene.arc_rad = 1e-3;
  EXPECT_EQ(find_status(scene), RotationStatus::single_yaw);
  Random random(3);
  EXPECT_EQ(find_status(scene, with_noise(scene.frames(0.3), random)), RotationStatus::single_yaw);
}

TEST(FindInPlaceRotationCaptures, ReturnsTooFewCapturesStatusForOneOrTwoCaptures) {
  RotationScene scene;
  for (const int captures : {1, 2}) {
    scene.captures = captures;
    EXPECT_EQ(find_status(scene), RotationStatus::too_few_captures) << captures;
  }
  EXPECT_EQ(find_status(scene, {}), RotationStatus::other_map);
}

TEST(FindInPlaceRotationCaptures, ReturnsTooFewLampsStatusForOneLampPerCapture) {
  RotationScene scene;
  auto frames = scene.frames();
  for (Frame& frame : frames) {
    std::erase_if(frame.detections, [](const Detection& one) { return one.lamp != 7; });
  }
  EXPECT_EQ(find_status(scene, frames), RotationStatus::too_few_lamps);
  scene.map.lamps.resize(1);
  EXPECT_EQ(find_status(scene), RotationStatus::too_few_lamps);
  // Two lamps in total, but one per capture.
  RotationScene in_turn;
  frames = in_turn.frames();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::erase_if(frames[i].detections,
                  [&](const Detection& one) { return one.lamp != (i % 2 == 0 ? 7 : 8); });
  }
  EXPECT_EQ(find_status(in_turn, frames), RotationStatus::too_few_lamps);
}

TEST(FindInPlaceRotationCaptures, ReturnsOtherMapStatusForUnknownMirroredOrSwappedLamps) {
  RotationScene scene;
  const auto frames = scene.frames();
  for (Lamp& lamp : scene.map.lamps) lamp.id += 100;
  EXPECT_EQ(find_status(scene, frames), RotationStatus::other_map);
  scene = {};
  for (Lamp& lamp : scene.map.lamps) lamp.position_m.x() *= -1;  // as seen from below
  EXPECT_EQ(find_status(scene, frames), RotationStatus::other_map);
  scene = {};
  std::swap(scene.map.lamps[1].position_m, scene.map.lamps[6].position_m);
  std::swap(scene.map.lamps[0].position_m, scene.map.lamps[5].position_m);
  std::swap(scene.map.lamps[2].position_m, scene.map.lamps[4].position_m);
  EXPECT_EQ(find_status(scene, frames), RotationStatus::other_map);
}

TEST(FindInPlaceRotationCaptures, ReturnsMovedStatusWhenAxisMovesBetweenCaptures) {
  RotationScene scene;
  std::vector<Frame> frames;
  for (int k = 0; k < 12; ++k) {
    scene.axis_m = {-0.3 + 0.05 * k, 0.1 * (k % 3)};
    frames.push_back(scene.frames()[static_cast<std::size_t>(k)]);
  }
  EXPECT_EQ(find_status(scene, frames), RotationStatus::axis_moved);
}

}  // namespace
}  // namespace vlp
