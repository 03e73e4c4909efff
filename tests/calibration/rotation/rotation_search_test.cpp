// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Limits of the search for a rotation in place, and the members of its result.
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "calibration/rotation/rotation_captures.h"
#include "calibration/rotation/spot.h"
#include "camera/lens.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Adds exact frames of single captures. Frames are named by their index.
class RotationFrames {
 public:
  explicit RotationFrames(const RotationScene& scene) : scene_(scene) {
    scene_.captures = 1;
    scene_.only_in_image = false;
  }

  Frame& add(double yaw_rad, double height_m = 0, const Eigen::Vector2d& axis_shift_m = {0, 0}) {
    RotationScene single = scene_;
    single.first_rad = yaw_rad;
    single.heights_m = {height_m};
    single.axis_m += axis_shift_m;
    frames.push_back(single.frames().front());
    frames.back().image = std::to_string(frames.size() - 1);
    return frames.back();
  }
  void add_turn(int count, double height_m, double arc_rad = 2 * std::numbers::pi) {
    for (int i = 0; i < count; ++i) add(0.3 + arc_rad * i / count, height_m);
  }
  RotationCaptures find() const { return detect_pivots(frames, scene_.map, scene_.camera); }

  std::vector<Frame> frames;

 private:
  RotationScene scene_;
};

std::vector<std::size_t> list_heights(const RotationCaptures& rotation) {
  std::vector<std::size_t> heights;
  for (const RotationCapture& capture : rotation.captures) heights.push_back(capture.height);
  return heights;
}

std::vector<std::string> list_rejected_images(const RotationCaptures& rotation) {
  std::vector<std::string> images;
  for (const auto& rejected : rotation.rejected_captures) images.push_back(rejected.image);
  return images;
}

TEST(DetectPivots, RequiresThreeCapturesWithDetections) {
  RotationFrames frames((RotationScene()));
  EXPECT_EQ(frames.find().status, RotationStatus::other_map) << "no capture";
  frames.add(0);
  frames.add(2);
  for (int i = 0; i < 3; ++i) frames.frames.push_back({"empty", {}});
  EXPECT_EQ(frames.find().status, RotationStatus::too_few_captures);
  frames.add(4);
  const RotationCaptures rotation = frames.find();
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  EXPECT_EQ(rotation.captures.size(), 3U);
}

/// Two captures with a fix, and others without one.
TEST(DetectPivots, StatusIsMostFrequentReasonOfFailedFixes) {
  RotationScene mirrored;
  for (Lamp& lamp : mirrored.map.lamps) lamp.position_m.x() *= -1;
  const auto one_lamp = [](Frame& frame) { frame.detections.resize(1); };
  const auto duplicate = [](Frame& frame) { frame.detections[1].lamp = 1; };
  const auto mirror = [&](Frame& frame) { frame.detections = mirrored.frames()[0].detections; };
  const auto collapse = [](Frame& frame) {
    for (Detection& detection : frame.detections) detection.pixel = frame.detections[0].pixel;
  };
  const auto shuffle = [](Frame& frame) {
    for (Detection& detection : frame.detections) detection.lamp = (3 * detection.lamp) % 8 + 1;
    frame.detections.resize(7);
  };
  using Changes = std::vector<std::function<void(Frame&)>>;
  const auto find_status = [](const Changes& changes) {
    RotationFrames frames((RotationScene()));
    for (const auto& change : changes) change(frames.add(1));
    frames.add(0);
    frames.add(2);
    return frames.find().status;
  };
  EXPECT_EQ(find_status({duplicate}), RotationStatus::too_few_captures);
  EXPECT_EQ(find_status({one_lamp}), RotationStatus::too_few_lamps);
  EXPECT_EQ(find_status({one_lamp, duplicate, duplicate}), RotationStatus::too_few_lamps);
  for (const std::function<void(Frame&)>& contradict : Changes{mirror, collapse, shuffle}) {
    EXPECT_EQ(find_status({contradict}), RotationStatus::other_map);
    EXPECT_EQ(find_status({contradict, one_lamp}), RotationStatus::too_few_lamps);
    EXPECT_EQ(find_status({contradict, one_lamp, contradict}), RotationStatus::other_map);
  }
}

TEST(DetectPivots, RequiresArcOf90Degrees) {
  for (const double arc_deg : {88., 92.}) {
    RotationFrames frames((RotationScene()));
    for (int i = 0; i < 5; ++i) frames.add(0.3 + rad_from_deg(arc_deg) * i / 4);
    EXPECT_EQ(frames.find().status, arc_deg > 90 ? RotationStatus::ok : RotationStatus::short_arc);
  }
}

TEST(DetectPivots, ReturnsSingleYawStatusForArcBelowTwentiethRadian) {
  const auto find_status = [](const std::vector<double>& arcs_rad) {
    RotationFrames frames((RotationScene()));
    for (std::size_t height = 0; height < arcs_rad.size(); ++height) {
      for (int i = 0; i < 3; ++i) {
        frames.add(0.3 + arcs_rad[height] * i / 2, 0.3 * static_cast<double>(height));
      }
    }
    return frames.find().status;
  };
  EXPECT_EQ(find_status({0.048}), RotationStatus::single_yaw);
  EXPECT_EQ(find_status({0.052}), RotationStatus::short_arc);
  // One height with a rotation suffices for a short arc.
  EXPECT_EQ(find_status({0.048, 0.5}), RotationStatus::short_arc);
  EXPECT_EQ(find_status({0.5, 0.048}), RotationStatus::short_arc);
  EXPECT_EQ(find_status({0.048, 0.02}), RotationStatus::single_yaw);
}

TEST(DetectPivots, SeparatesHeightsThatDifferByMoreThanOnePercentOfDistance) {
  const auto count_heights = [](const std::vector<double>& heights_m) {
    RotationFrames frames((RotationScene()));
    for (const double height_m : heights_m) frames.add_turn(4, height_m);
    const RotationCaptures rotation = frames.find();
    EXPECT_EQ(rotation.status, RotationStatus::ok);
    return rotation.heights.size();
  };
  // Distances from the lamps of 1.6 and 2 m.
  EXPECT_EQ(count_heights({0, 0.0155}), 1U);
  EXPECT_EQ(count_heights({0, 0.0165}), 2U);
  EXPECT_EQ(count_heights({-0.4, -0.3805}), 1U);
  EXPECT_EQ(count_heights({-0.4, -0.3795}), 2U);
  // Gaps between neighbors count.
  EXPECT_EQ(count_heights({0, 0.012, 0.024}), 1U);
  EXPECT_EQ(count_heights({0.024, 0, 0.06, 0.012}), 2U);
}

/// Captures of four heights in mixed order. The lowest has too few captures, the third too small an
/// arc.
TEST(DetectPivots, NumbersHeightsFromLowestAndRejectsOthers) {
  RotationScene scene = tilted_scene({0.02, -0.03});
  for (std::size_t i = 0; i < scene.map.lamps.size(); ++i) {
    scene.map.lamps[i].position_m.z() += 0.02 * static_cast<double>(i);
  }
  RotationFrames frames(scene);
  for (int i = 0; i < 4; ++i) {
    const double yaw_rad = 0.3 + 1.5 * i;
    frames.add(yaw_rad, 0.5);
    if (i < 2) frames.add(yaw_rad, 0);
    frames.add(yaw_rad, 0.2);
    frames.add(0.3 + 0.2 * i, 0.35);
  }
  frames.add(3, 0.5).detections.resize(1);
  const RotationCaptures rotation = frames.find();
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  ASSERT_EQ(rotation.heights.size(), 2U);
  EXPECT_NEAR(rotation.heights[0].z_m, 0.2, 1e-6);
  EXPECT_NEAR(rotation.heights[1].z_m, 0.5, 1e-6);
  for (const RotationHeight& height : rotation.heights) {
    EXPECT_EQ(height.captures, 4);
    EXPECT_NEAR(height.arc_rad, 4.5, 1e-6);
    EXPECT_THAT(height.axis_m, IsNear(scene.axis_m, 1e-6));
  }
  const std::vector<std::size_t> expected = {1, 0, 1, 0, 1, 0, 1, 0};
  EXPECT_EQ(list_heights(rotation), expected);
  ASSERT_EQ(rotation.captures.size(), 8U);
  EXPECT_EQ(rotation.captures[1].image, "2");
  EXPECT_EQ(rotation.captures[7].image, "12");
  EXPECT_NEAR(wrap_angle_rad(rotation.captures[7].yaw_rad - 4.8), 0, 1e-6);
  EXPECT_THAT(list_rejected_images(rotation),
              testing::ElementsAre("1", "3", "5", "7", "10", "13", "14"));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(rotation.rejected_captures[i].reason,
              "too few captures, or too small an arc, at its height");
  }
  EXPECT_EQ(rotation.rejected_captures[6].reason, describe_fix_status(FixStatus::too_few_lamps));
  EXPECT_THAT(rotation.lever_arm_m, IsNear(scene.lever_arm_m, 1e-6));
  EXPECT_THAT(rotation.zenith_in_camera, IsNear(scene.truth().zenith_in_camera, 1e-6));
}

/// Each yaw occurs twice, with the axis displaced to either side. All distances from the mean axis
/// are then equal. The limit of their median is 5 % of the height of the lamps.
TEST(DetectPivots, ReturnsAxisMovedStatusForMedianDistanceAboveFivePercent) {
  for (const double distance_m : {0.077, 0.083}) {
    RotationFrames frames((RotationScene()));
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector2d shift_m = distance_m * Eigen::Vector2d(0.6, 0.8);
      frames.add(i, 0, shift_m);
      frames.add(i, 0, -shift_m);
    }
    EXPECT_EQ(frames.find().status,
              distance_m < 0.08 ? RotationStatus::ok : RotationStatus::axis_moved);
  }
}

/// The limit is 1 % of the height of the lamps for captures that agree exactly.
TEST(DetectPivots, RejectsCaptureFarFromAxisOfOthers) {
  for (const double distance_m : {0.0155, 0.0165}) {
    RotationFrames frames((RotationScene()));
    for (int i = 0; i < 8; ++i) {
      frames.add(0.8 * i, 0, i == 3 ? Eigen::Vector2d(0, distance_m) : Eigen::Vector2d(0, 0));
    }
    const RotationCaptures rotation = frames.find();
    ASSERT_EQ(rotation.status, RotationStatus::ok);
    if (distance_m < 0.016) {
      EXPECT_TRUE(rotation.rejected_captures.empty());
      EXPECT_EQ(rotation.captures.size(), 8U);
      continue;
    }
    ASSERT_THAT(list_rejected_images(rotation), testing::ElementsAre("3"));
    EXPECT_EQ(rotation.rejected_captures[0].reason,
              "its fix is not on the rotation axis of the others");
    ASSERT_EQ(rotation.captures.size(), 7U);
    EXPECT_EQ(rotation.captures[3].image, "4");
    // Observations refer to the remaining captures.
    ASSERT_EQ(rotation.observations.size(), 56U);
    EXPECT_EQ(rotation.observations[24].capture, 3U);
    EXPECT_EQ(rotation.observations[24].pixel, frames.frames[4].detections[0].pixel);
  }
}

/// Before the tilt is estimated, the lamps have residuals of about 10 % of their distances.
TEST(DetectPivots, FindsRotationOfCameraTiltedBy27Degrees) {
  RotationScene scene;
  scene.tilt_rad = rad_from_deg(27);
  scene.camera = fisheye_camera();
  RotationFrames frames(scene);
  frames.add_turn(7, 0);
  const RotationCaptures rotation = frames.find();
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  EXPECT_EQ(rotation.captures.size(), 7U);
  EXPECT_THAT(rotation.zenith_in_camera, IsNear(scene.truth().zenith_in_camera, 1e-8));
}

TEST(DetectPivots, ObservationsHaveRayOfEachKnownLamp) {
  RotationScene scene = tilted_scene({0, 0});
  RotationFrames frames(scene);
  frames.add_turn(5, 0);
  for (Frame& frame : frames.frames) {
    std::erase_if(frame.detections, [](const Detection& seen) { return seen.lamp == 3; });
    frame.detections.insert(frame.detections.begin() + 1, {77, {100, 200}, 0.5});
  }
  frames.frames[2].detections[4].sigma_px = 0.25;
  frames.frames[2].detections[5].sigma_px.reset();
  const RotationCaptures rotation = frames.find();
  ASSERT_EQ(rotation.status, RotationStatus::ok);
  std::vector<int> ids;
  for (const Lamp& lamp : rotation.lamps) ids.push_back(lamp.id);
  EXPECT_THAT(ids, testing::ElementsAre(1, 2, 4, 5, 6, 7, 8));
  EXPECT_FALSE(rotation.median_sigma_px);
  ASSERT_EQ(rotation.observations.size(), 35U);
  EXPECT_EQ(rotation.observations[14 + 3].sigma_px, 0.25);
  EXPECT_FALSE(rotation.observations[14 + 4].sigma_px);
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  for (std::size_t i = 0; i < 35; ++i) {
    const RotationObservation& observation = rotation.observations[i];
    EXPECT_EQ(observation.capture, i / 7);
    EXPECT_EQ(observation.lamp, i % 7);
    const auto& detections = frames.frames[i / 7].detections;
    EXPECT_EQ(observation.pixel, detections[i % 7 == 0 ? 0 : i % 7 + 1].pixel);
    EXPECT_NEAR(observation.ray.norm(), 1, 1e-12);
    const auto pixel = lens.project_point(observation.ray);
    ASSERT_TRUE(pixel);
    EXPECT_THAT(*pixel, IsNear(observation.pixel, 1e-6));
  }
}

TEST(DescribeRotationStatus, DescribesEachStatusDifferently) {
  std::set<std::string> descriptions{""};
  for (const auto status :
       {RotationStatus::ok, RotationStatus::other_map, RotationStatus::too_few_lamps,
        RotationStatus::too_few_captures, RotationStatus::single_yaw, RotationStatus::short_arc,
        RotationStatus::axis_moved}) {
    EXPECT_TRUE(descriptions.emplace(describe_status(status)).second);
  }
}

}  // namespace
}  // namespace vlp
