// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/map/map_errors.h"

#include <gmock/gmock.h>

#include <cmath>
#include <utility>

#include "calibration/tilt/drive.h"
#include "camera/lens.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

/// Camera that is tilted by 3 degrees, which its calibration does not contain.
class DetectMapErrors : public testing::Test {
 protected:
  Random random{41};
  SyntheticRig rig = make_tilted_rig(0.05, 1);
  std::vector<Frame> frames = noisy_drive();
  LampMap map = rig.map;

  Calibration extract_camera() const {
    Calibration camera;
    camera.camera = rig.calibration.camera;
    return camera;
  }
  std::vector<MapError> errors() const {
    return detect_map_errors(frames, map, extract_camera()).errors;
  }
  std::string found() const { return describe_map_errors(errors()); }
  std::vector<MapErrorKind> kinds() const {
    std::vector<MapErrorKind> kinds;
    for (const MapError& error : errors()) kinds.push_back(error.kind);
    return kinds;
  }
  std::vector<Frame> noisy_drive() {
    std::vector<Frame> noisy = drive(rig, 20, random, 0.1);
    for (Frame& frame : noisy) frame.detections = with_noise(frame.detections, random);
    return noisy;
  }
  void use_lamps(std::size_t count) {
    rig.map.lamps.resize(count);
    map = rig.map;
    frames = noisy_drive();
  }
  /// Adds survey errors to the map.
  void survey(double sd_m) {
    map = rig.map;
    for (Lamp& lamp : map.lamps) {
      lamp.position_m += sd_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    }
  }
  Eigen::Vector3d& place(std::size_t lamp) { return map.lamps[lamp].position_m; }
};

TEST_F(DetectMapErrors, ReturnsNoErrorsForMapCorrectWithinFiveMillimeters) {
  ASSERT_THAT(detect_map_errors(frames, map, extract_camera()).offsets, SizeIs(map.lamps.size()));
  EXPECT_EQ(found(), "");
  for (Lamp& lamp : map.lamps) lamp.position_m.x() += random.uniform(-0.005, 0.005);
  EXPECT_EQ(found(), "") << "5 mm are for --refine-map";
}

TEST_F(DetectMapErrors, ReturnsOffsetOfOneMovedLampForTiltedCamera) {
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    map = rig.map;
    place(i).head<2>() += Eigen::Vector2d(-0.03, 0.004);
    const auto one = errors();
    ASSERT_THAT(one, SizeIs(1)) << found();
    EXPECT_EQ(one[0].kind, MapErrorKind::moved);
    EXPECT_EQ(one[0].lamps, std::vector<int>{map.lamps[i].id});
    EXPECT_LT((one[0].offset_m - Eigen::Vector3d(0.03, -0.004, 0)).norm(), 1e-3);
    const MapErrors leveled = detect_map_errors(frames, map, rig.calibration);
    EXPECT_EQ(describe_map_errors(leveled.errors), found()) << "with the tilt in the calibration";
    EXPECT_THAT(leveled.offsets, SizeIs(map.lamps.size()));
  }
}

TEST_F(DetectMapErrors, ReturnsThreeDisplacedLampsOfEight) {
  survey(1e-3);
  place(0).x() += 0.05;
  place(3).y() -= 0.07;
  place(6).x() += 0.06;
  const auto three = errors();
  ASSERT_THAT(three, SizeIs(3)) << found();
  std::vector<int> lamps;
  for (const MapError& error : three) lamps.push_back(error.lamps[0]);
  EXPECT_THAT(lamps, testing::UnorderedElementsAre(1, 4, 7));
}

/// With three lamps any of them may be displaced. With four, the other lamps determine the scatter
/// of the map poorly.
TEST_F(DetectMapErrors, ReportsNoMovedLampOfThreeOrFourWithoutGivenSd) {
  use_lamps(3);
  place(0).x() += 0.05;
  EXPECT_THAT(errors(), IsEmpty());
  rig = make_tilted_rig(0.05, 1);
  use_lamps(4);
  survey(1e-3);
  place(0).x() += 0.03;
  EXPECT_THAT(errors(), IsEmpty());
  for (Lamp& lamp : map.lamps) lamp.sd_m = 1e-3;
  EXPECT_THAT(errors(), SizeIs(1)) << "the survey states its errors";
  place(0) = rig.map.lamps[0].position_m;
  EXPECT_THAT(errors(), IsEmpty());
}

/// Its detections contradict the other lamps in all directions. They are rejected, but the lamp is
/// still reported.
TEST_F(DetectMapErrors, ReportsOnlyTheLampOfWrongHeight) {
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    map = rig.map;
    place(i).z() -= 0.1;
    const auto wrong = errors();
    ASSERT_THAT(wrong, SizeIs(1)) << "lamp " << map.lamps[i].id << ": " << found();
    EXPECT_EQ(wrong[0].lamps, std::vector<int>{map.lamps[i].id}) << found();
  }
}

/// In a large room each capture contains few of the lamps.
TEST_F(DetectMapErrors, DetectsMirroredMapOfLargeRoom) {
  constexpr int rows = 5;
  constexpr double distance_m = 1.2, height_m = 2.5, reach_m = 1.9;
  map.lamps.clear();
  for (int i = 0; i < rows * rows; ++i) {
    Lamp lamp;
    lamp.id = i + 1;
    lamp.position_m = {distance_m * (i % rows), distance_m * (i / rows), height_m};
    map.lamps.push_back(lamp);
  }
  const Lens lens(rig.calibration.camera.lens_model, rig.calibration.camera.intrinsics);
  frames.clear();
  for (int i = 0; i < 120; ++i) {
    const Eigen::Vector3d camera_m(random.uniform(0, (rows - 1) * distance_m),
                                   random.uniform(0, (rows - 1) * distance_m), 0);
    Frame frame{std::to_string(i), {}};
    for (const Lamp& lamp : map.lamps) {
      const Eigen::Vector3d ray = lamp.position_m - camera_m;
      const auto pixel = ray.head<2>().norm() < reach_m ? lens.project_point(ray) : std::nullopt;
      if (pixel) frame.detections.push_back({lamp.id, *pixel, 0.05});
    }
    frames.push_back(frame);
  }
  EXPECT_EQ(found(), "");
  for (Lamp& lamp : map.lamps) lamp.position_m.y() *= -1;
  EXPECT_THAT(kinds(), ElementsAre(MapErrorKind::mirrored));
  for (Lamp& lamp : map.lamps) {
    lamp.position_m.x() = random.uniform(0, rows * distance_m);
    lamp.position_m.y() = random.uniform(0, rows * distance_m);
  }
  EXPECT_THAT(kinds(), ElementsAre(MapErrorKind::other_room));
}

TEST_F(DetectMapErrors, ReportsErrorsForAtMostTenOf400CorrectMaps) {
  constexpr int maps = 400, max_alarms = 10;  // p = 0.01: 4 are expected
  for (const std::size_t lamps : {5U, 8U}) {
    rig = make_tilted_rig(0.05, 1);
    use_lamps(lamps);
    for (const bool is_stated : {false, true}) {
      int alarms = 0;
      for (int i = 0; i < maps; ++i) {
        survey(2e-3);
        for (Lamp& lamp : map.lamps) {
          if (is_stated) lamp.sd_m = 2e-3;
        }
        const MapErrors judged = detect_map_errors(frames, map, extract_camera());
        // Without offsets and errors, the captures would be too few for an alarm.
        ASSERT_FALSE(judged.offsets.empty() && judged.errors.empty());
        alarms += judged.errors.empty() ? 0 : 1;
      }
      RecordProperty("alarms_" + std::to_string(lamps) + (is_stated ? "_stated" : ""), alarms);
      EXPECT_LE(alarms, max_alarms) << lamps << " lamps, stated " << is_stated;
    }
  }
}

TEST_F(DetectMapErrors, OffsetSdsMatchErrorsOfReportedOffsets) {
  constexpr int maps = 200;
  double squares = 0;
  int count = 0;
  for (int i = 0; i < maps; ++i) {
    survey(2e-3);
    place(2).y() += 0.05;
    for (Lamp& lamp : map.lamps) lamp.sd_m = 2e-3;
    for (const MapError& error : errors()) {
      if (error.lamps != std::vector<int>{3}) continue;
      const Eigen::Vector2d difference_m = error.offset_m.head<2>() - Eigen::Vector2d(0, -0.05);
      squares += difference_m.cwiseQuotient(error.sd_m.head<2>()).squaredNorm() / 2;
      ++count;
    }
  }
  ASSERT_GT(count, maps * 9 / 10);
  RecordProperty("error_over_sd", std::to_string(std::sqrt(squares / count)));
  EXPECT_NEAR(std::sqrt(squares / count), 1, 0.15);
}

TEST_F(DetectMapErrors, DetectsMirroredMap) {
  for (Lamp& lamp : map.lamps) lamp.position_m.y() *= -1;
  EXPECT_THAT(kinds(), ElementsAre(MapErrorKind::mirrored));
}

TEST_F(DetectMapErrors, NamesBothSwappedLampsOfEight) {
  for (const auto& [first, second] : {std::pair(2, 4), std::pair(0, 7)}) {
    map = rig.map;
    std::swap(place(static_cast<std::size_t>(first)), place(static_cast<std::size_t>(second)));
    const auto swapped = errors();
    ASSERT_THAT(kinds(), ElementsAre(MapErrorKind::swapped));
    EXPECT_THAT(swapped[0].lamps, ElementsAre(first + 1, second + 1));
  }
}

TEST_F(DetectMapErrors, NamesBothSwappedLampsOfFour) {
  use_lamps(4);
  rig.map.lamps[1].position_m.x() =
      0.5;  // a rectangle's mirror image is an exchange of its corners
  use_lamps(4);
  std::swap(place(0), place(2));
  ASSERT_THAT(kinds(), ElementsAre(MapErrorKind::swapped));
  EXPECT_THAT(errors()[0].lamps, ElementsAre(1, 3));
}

/// No similarity takes a square to its mirror image.
TEST_F(DetectMapErrors, DetectsMirroredMapOfLampsInSquare) {
  for (std::size_t i = 0; i < 4; ++i) {
    Eigen::Vector3d& corner_m = rig.map.lamps[i].position_m;
    corner_m.x() = std::copysign(corner_m.y(), corner_m.x());
  }
  use_lamps(4);
  EXPECT_THAT(errors(), IsEmpty());
  for (Lamp& lamp : map.lamps) lamp.position_m.x() *= -1;
  EXPECT_THAT(kinds(), ElementsAre(MapErrorKind::mirrored));
}

TEST_F(DetectMapErrors, ReportsLampWhoseDetectionsContradictOtherLamps) {
  for (std::size_t i = 0; i < 6; ++i) {
    std::swap(frames[i].detections[0], frames[i].detections.back());
    frames[i].detections.back().pixel += Eigen::Vector2d(i % 2 == 0 ? 60 : -40, 30);
  }
  ASSERT_THAT(kinds(), ElementsAre(MapErrorKind::inconsistent));
  EXPECT_THAT(errors()[0].lamps, ElementsAre(1));
  EXPECT_EQ(errors()[0].contradicting_captures, 6);
}

TEST_F(DetectMapErrors, ReportsMapOfOtherRoomOnlyIfItHasDetectedIds) {
  for (Lamp& lamp : map.lamps) {
    lamp.position_m.head<2>() = Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
  }
  EXPECT_THAT(kinds(), ElementsAre(MapErrorKind::other_room));
  for (Lamp& lamp : map.lamps) lamp.id += 100;
  EXPECT_EQ(found(), "");
  EXPECT_THAT(list_undetected_lamps(frames, map), SizeIs(map.lamps.size()));
  frames.clear();
  EXPECT_EQ(found(), "");
}

}  // namespace
}  // namespace vlp
