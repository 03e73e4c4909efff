// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Limits of the errors of a lamp map, and their descriptions.
#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calibration/map/map_errors.h"
#include "camera/lens.h"
#include "positioning/inclination_rotation.h"
#include "support/matchers.h"
#include "support/random.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

/// Mean height of the lamps above the captures of DetectMapErrorsAtLimits.
constexpr double kMeanHeight_m = 1.45;

MapError make_moved_lamp(int lamp, const Eigen::Vector3d& offset_mm) {
  return {MapErrorKind::moved, {lamp}, 1e-3 * offset_mm};
}

TEST(DescribeMapError, RoundsOffsetsToWholeMillimetersFromTenMillimetersOn) {
  EXPECT_EQ(describe_map_error(make_moved_lamp(7, {12.4, -3.6, 0.2})),
            "lamp 7 hangs 13 mm from where the map has it (x +12 mm, y -4 mm): moved, or entered "
            "wrongly");
  EXPECT_EQ(describe_map_error(make_moved_lamp(7, {12.4, -0.3, -2.6})),
            "lamp 7 hangs 13 mm from where the map has it (x +12 mm, y +0 mm, z -3 mm): moved, or "
            "entered wrongly");
  EXPECT_EQ(describe_map_error(make_moved_lamp(3, {-5.26, 2.33, 0.04})),
            "lamp 3 hangs 5.8 mm from where the map has it (x -5.3 mm, y +2.3 mm): moved, or "
            "entered wrongly");
  EXPECT_EQ(describe_map_error(make_moved_lamp(3, {0, 0, 0.06})),
            "lamp 3 hangs 0.1 mm from where the map has it (x +0.0 mm, y +0.0 mm, z +0.1 mm): "
            "moved, or entered wrongly");
  EXPECT_THAT(describe_map_error(make_moved_lamp(1, {9.94, 0, 0})),
              testing::HasSubstr("hangs 9.9 mm"));
  EXPECT_THAT(describe_map_error(make_moved_lamp(1, {0, 9.96, 0})),
              testing::HasSubstr("hangs 10 mm from where the map has it (x +0 mm, y +10 mm)"));
}

TEST(DescribeMapErrors, DescribesEachKindDifferently) {
  MapErrors found;
  std::set<std::string> descriptions{""};
  for (const MapErrorKind kind :
       {MapErrorKind::moved, MapErrorKind::inconsistent, MapErrorKind::swapped,
        MapErrorKind::mirrored, MapErrorKind::other_room, MapErrorKind::undetected}) {
    found.errors.push_back({kind, {5, 2}});
    EXPECT_TRUE(descriptions.insert(describe_map_error(found.errors.back())).second);
  }
  std::size_t length = 0;
  for (const std::string& description : descriptions) length += description.size();
  EXPECT_EQ(describe_map_errors(found.errors).size(), length + 5 * 2) << "separated by semicolons";
  EXPECT_EQ(describe_map_errors({}), "");
  EXPECT_THAT(describe_moved_lamps(3), testing::StartsWith("3 lamps"));
}

TEST(IsMapUnusable, ReturnsTrueOnlyForSwappedOrMirroredLamps) {
  MapErrors found;
  EXPECT_FALSE(found.is_map_unusable());
  for (const auto& [kind, is_unusable] :
       {std::pair(MapErrorKind::moved, false), std::pair(MapErrorKind::inconsistent, false),
        std::pair(MapErrorKind::swapped, true), std::pair(MapErrorKind::mirrored, true),
        std::pair(MapErrorKind::other_room, false), std::pair(MapErrorKind::undetected, false)}) {
    found.errors = {{MapErrorKind::moved, {1}}, {kind, {2}}};
    EXPECT_EQ(found.is_map_unusable(), is_unusable) << static_cast<int>(kind);
  }
}

TEST(ListUndetectedLamps, ListsLampsInNoFrameInOrderOfMap) {
  const std::vector<Frame> frames{{"a", {{2, {0, 0}, {}}, {5, {0, 0}, {}}}}, {"b", {}}};
  const auto found = list_undetected_lamps(frames, synthetic_lamps());
  std::vector<int> ids;
  for (const MapError& error : found) {
    EXPECT_EQ(error.kind, MapErrorKind::undetected);
    ASSERT_THAT(error.lamps, SizeIs(1));
    ids.push_back(error.lamps[0]);
  }
  EXPECT_THAT(ids, ElementsAre(1, 3, 4, 6, 7, 8));
}

/// Eight lamps of several heights, and captures without noise of a camera whose calibration
/// contains its tilt.
class DetectMapErrorsAtLimits : public testing::Test {
 protected:
  DetectMapErrorsAtLimits() {
    rig.map = make_lamp_map({{-0.8, -0.4, 1.60},
                             {0.8, -0.4, 1.62},
                             {0.7, 0.4, 1.58},
                             {-0.8, 0.5, 1.60},
                             {0.1, 0.5, 1.61},
                             {-0.3, -0.5, 1.60},
                             {0.5, 0.05, 1.59},
                             {-0.4, 0.1, 1.60}});
    rig.calibration.camera = synthetic_camera();
    rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.05, 1);
    calibration = rig.calibration;
    map = rig.map;
    options.min_offset_px = 0.05;
    take_captures(12);
  }

  void take_captures(int count) {
    frames.clear();
    for (int k = 0; k < count; ++k) {
      const Eigen::Vector3d position_m(0.15 * (k % 5) - 0.3, 0.1 * (k % 4) - 0.1,
                                       k % 2 ? 0.3 : 0.0);
      rig.camera = {origin_m + position_m, 1.1 * k};
      rig.inclination.reset();
      if (!options.inclinations.empty()) {
        if (const auto& inclination = options.inclinations[static_cast<std::size_t>(k)]) {
          rig.inclination = inclination;
        }
      }
      frames.push_back({std::to_string(k), seen_from(rig)});
    }
  }
  MapErrors detect() const { return detect_map_errors(frames, map, calibration, options); }
  Eigen::Vector3d& place(std::size_t lamp) { return map.lamps[lamp].position_m; }
  void set_survey_sd(double sd_m) {
    for (Lamp& lamp : map.lamps) lamp.sd_m = sd_m;
  }

  SyntheticRig rig{{}, {}, {{0, 0, 0}, 0}, {}};
  /// Position about which the captures are taken.
  Eigen::Vector3d origin_m{0, 0, 0};
  Calibration calibration;
  LampMap map;
  std::vector<Frame> frames;
  MapErrorOptions options;
};

/// All lamps at one height, far from the origin of the world.
TEST_F(DetectMapErrorsAtLimits, OffsetsAreExactWithOrWithoutTiltAndInclination) {
  origin_m = {12, -7, 2};
  for (Lamp& lamp : rig.map.lamps) {
    lamp.position_m.z() = 1.6;
    lamp.position_m += origin_m;
  }
  map = rig.map;
  place(2).head<2>() += Eigen::Vector2d(0.03, -0.02);
  for (const bool is_inclined : {false, true}) {
    for (const bool is_tilt_known : {true, false}) {
      options.inclinations.clear();
      if (is_inclined) {
        for (int k = 0; k < 12; ++k) {
          options.inclinations.emplace_back(Inclination{0.02 * (k % 3), 0.03 - 0.02 * (k % 4)});
          if (k % 5 == 0) options.inclinations.back().reset();
        }
      }
      take_captures(12);
      if (!is_tilt_known) calibration.rotation_center.reset();
      const MapErrors found = detect();
      calibration = rig.calibration;
      ASSERT_THAT(found.errors, SizeIs(1)) << is_inclined << is_tilt_known;
      EXPECT_EQ(found.errors[0].kind, MapErrorKind::moved);
      EXPECT_THAT(found.errors[0].lamps, ElementsAre(3));
      EXPECT_THAT(found.errors[0].offset_m, IsNear(Eigen::Vector3d(-0.03, 0.02, 0), 2e-6));
      ASSERT_THAT(found.offsets, SizeIs(8));
      for (const LampOffset& offset : found.offsets) EXPECT_EQ(offset.captures, 12);
      EXPECT_THAT(found.offsets[2].offset_m, IsNear(Eigen::Vector2d(-0.03, 0.02), 2e-6));
    }
  }
}

/// Robot with the camera turned on it: the inclination is that of the robot.
TEST_F(DetectMapErrorsAtLimits, InclinationsRotateWithYawOfCameraOnRobot) {
  options.yaw_in_robot_rad = 0.8;
  const Inclination of_robot{0.06, -0.04};
  const Eigen::Matrix3d level_from_base =
      compute_level_from_base(of_robot, options.yaw_in_robot_rad);
  const Lens lens(rig.calibration.camera.lens_model, rig.calibration.camera.intrinsics);
  const Eigen::Matrix3d camera_from_base =
      compute_level_from_camera_matrix(rig.calibration, Correction::all).transpose();
  frames.clear();
  for (int k = 0; k < 6; ++k) {
    const Pose camera{{0.1 * k - 0.2, 0.05 * k, 0.1 * k}, 1.1 * k};
    Frame frame{std::to_string(k), {}};
    for (const Lamp& lamp : rig.map.lamps) {
      const Eigen::Vector3d level = level_point_from_world(camera, lamp.position_m);
      const auto pixel =
          lens.project_point(camera_from_base * (level_from_base.transpose() * level));
      ASSERT_TRUE(pixel);
      frame.detections.push_back({lamp.id, *pixel, {}});
    }
    frames.push_back(frame);
    options.inclinations.emplace_back(of_robot);
  }
  const MapErrors found = detect();
  ASSERT_THAT(found.offsets, SizeIs(8));
  for (const LampOffset& offset : found.offsets) {
    EXPECT_THAT(offset.offset_m, IsNear(Eigen::Vector2d(0, 0), 1e-6)) << offset.lamp;
  }
}

/// Captures with two lamps, lamps that are detected twice, and ids that are not in the map.
TEST_F(DetectMapErrorsAtLimits, UsesCapturesWithThreeUniqueLampsOfTheMap) {
  frames[0].detections.resize(2);
  frames[0].detections.push_back({99, {400, 300}, {}});
  frames[1].detections.resize(3);
  frames[2].detections.push_back(frames[2].detections[0]);
  frames[3].detections.push_back({4, {400, 300}, {}});
  const MapErrors found = detect();
  EXPECT_THAT(found.errors, IsEmpty());
  ASSERT_THAT(found.offsets, SizeIs(8));
  std::vector<int> captures;
  for (const LampOffset& offset : found.offsets) {
    captures.push_back(offset.captures);
    EXPECT_THAT(offset.offset_m, IsNear(Eigen::Vector2d(0, 0), 1e-6));
  }
  EXPECT_THAT(captures, ElementsAre(10, 11, 11, 9, 10, 10, 10, 10));
}

TEST_F(DetectMapErrorsAtLimits, ReportsFewerThanHalfOfTheLampsAsMoved) {
  set_survey_sd(1e-4);
  const std::vector<std::size_t> moved{1, 3, 4, 6};
  for (const std::size_t count : {1U, 2U, 3U, 4U}) {
    map.lamps = rig.map.lamps;
    set_survey_sd(1e-4);
    std::vector<int> expected;
    for (std::size_t i = 0; i < count; ++i) {
      const double n = static_cast<double>(i);
      place(moved[i]) += 0.02 * Eigen::Vector3d(std::cos(2 * n), std::sin(2 * n), 0);
      expected.push_back(static_cast<int>(moved[i]) + 1);
    }
    std::vector<int> lamps;
    for (const MapError& error : detect().errors) {
      EXPECT_EQ(error.kind, MapErrorKind::moved);
      lamps.insert(lamps.end(), error.lamps.begin(), error.lamps.end());
    }
    if (count < 4) {
      EXPECT_THAT(lamps, testing::UnorderedElementsAreArray(expected));
    } else {
      EXPECT_LT(lamps.size(), 4U);
    }
  }
}

TEST_F(DetectMapErrorsAtLimits, ReportsNoMovedLampsIfMoreThanEightMoved) {
  std::vector<Eigen::Vector3d> positions_m;
  for (int i = 0; i < 20; ++i) {
    positions_m.emplace_back(0.4 * (i % 5) - 0.8 + 0.02 * (i % 3), 0.3 * (i / 5) - 0.45, 1.6);
  }
  rig.map = make_lamp_map(positions_m);
  take_captures(8);
  for (const std::size_t count : {8U, 9U}) {
    map = rig.map;
    set_survey_sd(1e-4);
    for (std::size_t i = 0; i < count; ++i) {
      const double n = static_cast<double>(i);
      place(2 * i + 1) += 0.01 * Eigen::Vector3d(std::cos(2 * n), std::sin(2 * n), 0);
    }
    EXPECT_THAT(detect().errors, SizeIs(count == 8 ? 8 : 0));
  }
}

/// The smallest offset is given in pixels at the mean height of the lamps above the camera.
TEST_F(DetectMapErrorsAtLimits, OmitsOffsetsBelowSmallestOffsetInPixels) {
  place(1).head<2>() += Eigen::Vector2d(0.012, -0.016);
  const double offset_px = 0.02 * 521 / kMeanHeight_m;
  options.min_offset_px = 0.98 * offset_px;
  EXPECT_THAT(detect().errors, SizeIs(1));
  options.min_offset_px = 1.02 * offset_px;
  const MapErrors found = detect();
  EXPECT_THAT(found.errors, IsEmpty());
  EXPECT_THAT(found.offsets, SizeIs(8));
}

/// Twenty captures with noise in which a lamp is confused with other lights.
class DetectInconsistentLamp : public DetectMapErrorsAtLimits {
 protected:
  DetectInconsistentLamp() {
    take_captures(20);
    options.min_offset_px = 0.25;
    Random random(3);
    for (Frame& frame : frames) {
      for (Detection& detection : frame.detections) {
        detection.pixel += 0.05 * Eigen::Vector2d{random.normal(), random.normal()};
      }
    }
  }
  void confuse(std::size_t lamp, std::size_t captures) {
    for (std::size_t k = 0; k < captures; ++k) {
      const double angle = 2.4 * static_cast<double>(k + lamp);
      frames[3 * k % 20].detections[lamp].pixel +=
          60 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
  }
};

TEST_F(DetectInconsistentLamp, ReportsLampThatContradictsOverTenPercentOfCaptures) {
  confuse(3, 2);
  EXPECT_THAT(detect().errors, IsEmpty()) << "10 %";
  frames[6].detections[3].pixel.x() += 60;
  const MapErrors found = detect();
  ASSERT_THAT(found.errors, SizeIs(1));
  EXPECT_EQ(found.errors[0].kind, MapErrorKind::inconsistent);
  EXPECT_THAT(found.errors[0].lamps, ElementsAre(4));
  EXPECT_EQ(found.errors[0].contradicting_captures, 3);
  EXPECT_EQ(found.errors[0].captures, 20);
}

TEST_F(DetectInconsistentLamp, ReportsLampOnlyIfItHasMajorityOfOutliers) {
  confuse(3, 4);
  const std::vector<Frame> before = frames;
  for (const std::size_t others : {3U, 4U}) {
    frames = before;
    for (std::size_t k = 0; k < others; ++k) frames[10 + 2 * k].detections[5].pixel.y() += 60;
    EXPECT_THAT(detect().errors, SizeIs(others == 3 ? 1 : 0)) << others;
  }
}

/// The median of the outliers has to exceed three standard deviations of the survey, and five times
/// the smallest offset of a moved lamp.
TEST_F(DetectInconsistentLamp, ReportsLampIfOutliersExceedSurveyErrorsAndMinOffset) {
  confuse(3, 5);
  // Returns the value from which on the lamp is not reported.
  const auto find_limit = [&](double high, const auto& set_value) {
    double low = 0;
    for (int iteration = 0; iteration < 14; ++iteration) {
      const double middle = (low + high) / 2;
      set_value(middle);
      (detect().errors.empty() ? high : low) = middle;
    }
    return low;
  };
  const double median_px = 5 * find_limit(40, [&](double px) { options.min_offset_px = px; });
  options.min_offset_px = 0.25;
  const double median_m = 3 * find_limit(0.2, [&](double sd_m) { map.lamps[3].sd_m = sd_m; });
  EXPECT_NEAR(median_px, 60, 1);
  EXPECT_NEAR(median_m / (median_px / 521 * kMeanHeight_m), 1, 0.01);
}

/// A parallelogram with two opposite corners swapped is the parallelogram with the other two
/// swapped, turned by half a turn.
TEST_F(DetectMapErrorsAtLimits, SwappedLampsAreNotNamedIfAnotherPairFitsAsWell) {
  for (const bool is_parallelogram : {true, false}) {
    rig.map = make_lamp_map({{-0.8, -0.4, 1.6},
                             {is_parallelogram ? 0.6 : 0.5, -0.4, 1.6},
                             {0.8, 0.4, 1.6},
                             {-0.6, 0.4, 1.6}});
    map = rig.map;
    std::swap(place(0), place(2));
    take_captures(12);
    const MapErrors found = detect();
    const bool is_swapped = !found.errors.empty() && found.errors[0].kind == MapErrorKind::swapped;
    EXPECT_EQ(is_swapped, !is_parallelogram) << describe_map_errors(found.errors);
    EXPECT_EQ(found.is_map_unusable(), !is_parallelogram);
  }
}

}  // namespace
}  // namespace vlp
