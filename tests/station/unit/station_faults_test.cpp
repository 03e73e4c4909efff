// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/station_faults.h"

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <span>

#include "camera/lens.h"
#include "positioning/positioner.h"
#include "support/example_rig.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

struct LampFaults : ExampleRig {};

TEST_F(LampFaults, DescribeLampMapFaultsNamesSwappedLamps) {
  for (std::size_t a = 0; a < map.lamps.size(); ++a) {
    for (std::size_t b = a + 1; b < map.lamps.size(); ++b) {
      LampMap swapped = map;
      std::swap(swapped.lamps[a].position_m, swapped.lamps[b].position_m);
      const auto faults = list_lamp_map_faults(frames, swapped, calibration);
      ASSERT_EQ(faults.size(), 1u) << a << " " << b;
      EXPECT_THAT(faults[0], HasSubstr(std::to_string(map.lamps[a].id) + " and " +
                                       std::to_string(map.lamps[b].id) + " seem to be swapped"));
    }
  }
}

TEST_F(LampFaults, DescribeLampMapFaultsNamesDisplacedLampAndDisplacement) {
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    LampMap moved = map;
    moved.lamps[i].position_m += Eigen::Vector3d(0.02, -0.01, 0);
    EXPECT_THAT(list_lamp_map_faults(frames, moved, calibration),
                ElementsAre("lamp " + std::to_string(map.lamps[i].id) +
                            " hangs 22 mm from where the map has it (x -20 mm, y +10 mm): moved, "
                            "or entered wrongly"));
  }
}

TEST_F(LampFaults, DescribeMissingLampsNamesNeverVisibleLamp) {
  const int id = map.lamps[2].id;
  for (Frame& frame : frames) {
    std::erase_if(frame.detections, [&](const Detection& lamp) { return lamp.lamp == id; });
  }
  EXPECT_THAT(list_missing_lamps(frames, map),
              ElementsAre(HasSubstr("lamp " + std::to_string(id) + " is never visible")));
  EXPECT_THAT(list_lamp_map_faults(frames, map, calibration), IsEmpty())
      << "it does not contradict the map";
  EXPECT_THAT(list_missing_lamps(std::span(frames).first(2), map), IsEmpty()) << "too few to tell";
}

/// A light that is mistaken for a lamp is rejected, and its capture has a large residual. That does
/// not mark the lamp as loose unless many captures agree.
TEST_F(LampFaults, DescribeLampMapFaultsNamesLampOnlyForManyContradictingCaptures) {
  constexpr double fits_px = 0.25;
  const int id = map.lamps[2].id;
  std::vector<Detection*> seen;
  for (Frame& frame : frames) {
    for (Detection& lamp : frame.detections) {
      if (lamp.lamp == id && frame.detections.size() > 3) seen.push_back(&lamp);
    }
  }
  ASSERT_GT(seen.size(), 20u);
  const std::size_t tenth = seen.size() / 10;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto faults = list_lamp_map_faults(frames, map, calibration, fits_px);
    if (i > tenth) {
      EXPECT_THAT(faults, ElementsAre(HasSubstr("lamp " + std::to_string(id) + " contradicts")))
          << i;
      break;
    }
    EXPECT_THAT(faults, IsEmpty()) << i << " of " << seen.size();
    constexpr double middle_px = 400, far_px = 80;
    seen[i]->pixel.x() += seen[i]->pixel.x() < middle_px ? far_px : -far_px;
  }
}

struct LensFault : ExampleRig {};

TEST_F(LensFault, DescribeContradictionToCalibratedLensIsEmptyForCorrectLens) {
  EXPECT_EQ(explain_lens_contradiction(frames, map, calibration), "");
  // A slightly different lens is not another lens.
  calibration.camera.intrinsics[0] *= 1.0005;
  calibration.camera.intrinsics[2] += 0.3;
  EXPECT_EQ(explain_lens_contradiction(frames, map, calibration), "");
}

/// As if the boards were of another unit.
TEST_F(LensFault, DescribeContradictionToCalibratedLensStatesFocalLengthsOfLampsAndBoards) {
  auto& lens = calibration.camera.intrinsics;
  const double shown_px = std::sqrt(lens[0] * lens[1]);
  for (const double focal : {0.98, 1.02}) {
    for (const double off_px : {0., 10.}) {
      const auto kept = lens;
      lens[0] *= focal;
      lens[1] *= focal;
      lens[2] += off_px;
      lens[3] -= off_px;
      const std::string fault = explain_lens_contradiction(frames, map, calibration);
      EXPECT_THAT(fault, AllOf(StartsWith("lamps and boards are imaged by different lenses"),
                               HasSubstr(fmt::format("the boards a focal length of {:.1f} px",
                                                     std::sqrt(lens[0] * lens[1])))))
          << focal << " " << off_px;
      const std::string before = "the lamps fit a focal length of ";
      const auto at = fault.find(before);
      ASSERT_NE(at, std::string::npos);
      EXPECT_NEAR(std::stod(fault.substr(at + before.size())), shown_px, 0.002 * shown_px);
      lens = kept;
    }
  }
}

/// A displaced lamp is an error of the map.
TEST_F(LensFault, DescribeContradictionToCalibratedLensIsEmptyForDisplacedLamp) {
  for (Lamp& lamp : map.lamps) {
    const Eigen::Vector3d kept_m = lamp.position_m;
    lamp.position_m += Eigen::Vector3d(0.02, -0.01, 0);
    EXPECT_EQ(explain_lens_contradiction(frames, map, calibration), "") << lamp.id;
    lamp.position_m = kept_m;
  }
}

TEST_F(LensFault, DescribeContradictionToCalibratedLensIsEmptyForTooFewCaptures) {
  calibration.camera.intrinsics[0] *= 1.02;
  EXPECT_EQ(explain_lens_contradiction({}, map, calibration), "");
  EXPECT_EQ(explain_lens_contradiction(std::span(frames).first(1), map, calibration), "");
}

/// Captures at known heights, equal to the fixes of the true camera.
struct OtherCamera : LensFault {
  OtherCamera() {
    const Positioner positioner(map, calibration);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Fix fix = positioner.compute_position_fix(frames[i].detections);
      if (!fix.has_succeeded()) continue;
      CapturesWithPositions& captures = i % 2 == 0 ? reference : check;
      captures.positions[frames[i].image].z_m = fix.state.pose.position_m.z();
      captures.frames.push_back(frames[i]);
    }
  }
  /// Replaces the detections of the check by those of a camera with another lens or tilt.
  void set_camera(const Lens& other, const Eigen::Matrix3d& other_from_camera) {
    const Lens lens(calibration.camera.lens_model, calibration.camera.intrinsics);
    for (Frame& frame : check.frames) {
      for (Detection& lamp : frame.detections) {
        const auto ray = lens.unproject_pixel(lamp.pixel);
        ASSERT_TRUE(ray);
        const auto pixel = other.project_point(other_from_camera * ray->direction);
        ASSERT_TRUE(pixel);
        lamp.pixel = *pixel;
      }
    }
  }
  CapturesWithPositions reference, check;
};

TEST_F(OtherCamera, DescribeDifferencesReturnEmptyTextForTiltedUnit) {
  ASSERT_GT(check.frames.size(), 10U);
  set_camera(Lens(calibration.camera.lens_model, calibration.camera.intrinsics),
             Eigen::AngleAxisd(0.005, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix());
  EXPECT_EQ(explain_focal_difference(check, reference, map, calibration), "");
  EXPECT_EQ(explain_other_lens(check.frames, reference.frames, map, calibration), "");
}

TEST_F(OtherCamera, DescribeFocalLengthDifferenceReportsOnePercentShorterFocalLength) {
  auto intrinsics = calibration.camera.intrinsics;
  intrinsics[0] *= 0.99;
  intrinsics[1] *= 0.99;
  set_camera(Lens(calibration.camera.lens_model, intrinsics), Eigen::Matrix3d::Identity());
  EXPECT_THAT(explain_focal_difference(check, reference, map, calibration),
              HasSubstr("its focal length differs: the heights have an error of "));
  reference.positions.clear();
  EXPECT_EQ(explain_focal_difference(check, reference, map, calibration), "")
      << "no heights to compare";
}

TEST_F(OtherCamera, DescribeLensDifferenceReportsDisplacedPrincipalPoint) {
  auto intrinsics = calibration.camera.intrinsics;
  intrinsics[2] += 12;
  intrinsics[3] -= 8;
  set_camera(Lens(calibration.camera.lens_model, intrinsics), Eigen::Matrix3d::Identity());
  EXPECT_THAT(explain_other_lens(check.frames, reference.frames, map, calibration),
              HasSubstr("its lens differs, by residuals of the lamps of "));
  EXPECT_EQ(explain_other_lens(check.frames, {}, map, calibration), "") << "nothing to compare";
}

}  // namespace
}  // namespace vlp
