// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lens_fault.h"

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "camera/lens.h"
#include "positioning/positioner.h"
#include "support/example_rig.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

struct LensFault : ExampleRig {};

TEST_F(LensFault, ReturnsEmptyForCorrectLens) {
  EXPECT_EQ(describe_lens_fault(frames, map, calibration), "");
  // A slightly different lens is not another lens.
  calibration.camera.intrinsics[0] *= 1.0005;
  calibration.camera.intrinsics[2] += 0.3;
  EXPECT_EQ(describe_lens_fault(frames, map, calibration), "");
}

/// As if the boards were of another unit.
TEST_F(LensFault, ReportsLensEstimatedFromLamps) {
  auto& lens = calibration.camera.intrinsics;
  const double shown_px = std::sqrt(lens[0] * lens[1]);
  for (const double focal : {0.98, 1.02}) {
    for (const double off_px : {0., 10.}) {
      const auto kept = lens;
      lens[0] *= focal;
      lens[1] *= focal;
      lens[2] += off_px;
      lens[3] -= off_px;
      const std::string fault = describe_lens_fault(frames, map, calibration);
      EXPECT_THAT(fault,
                  AllOf(StartsWith("the lamps are seen through another lens than the boards"),
                        HasSubstr(fmt::format("the boards a focal length of {:.1f} px",
                                              std::sqrt(lens[0] * lens[1])))))
          << focal << " " << off_px;
      const std::string before = "they show a focal length of ";
      const auto at = fault.find(before);
      ASSERT_NE(at, std::string::npos);
      EXPECT_NEAR(std::stod(fault.substr(at + before.size())), shown_px, 0.002 * shown_px);
      lens = kept;
    }
  }
}

/// A displaced lamp is an error of the map.
TEST_F(LensFault, ReturnsEmptyForDisplacedLamp) {
  for (Lamp& lamp : map.lamps) {
    const Eigen::Vector3d kept_m = lamp.position_m;
    lamp.position_m += Eigen::Vector3d(0.02, -0.01, 0);
    EXPECT_EQ(describe_lens_fault(frames, map, calibration), "") << lamp.id;
    lamp.position_m = kept_m;
  }
}

TEST_F(LensFault, ReturnsEmptyForTooFewCaptures) {
  calibration.camera.intrinsics[0] *= 1.02;
  EXPECT_EQ(describe_lens_fault({}, map, calibration), "");
  EXPECT_EQ(describe_lens_fault(std::span(frames).first(1), map, calibration), "");
}

/// Captures at known heights, equal to the fixes of the true camera.
struct OtherCamera : LensFault {
  OtherCamera() {
    const Positioner positioner(map, calibration);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Fix fix = positioner.locate(frames[i].detections);
      if (!fix.ok()) continue;
      PlacedCaptures& captures = i % 2 == 0 ? reference : check;
      captures.places[frames[i].image].z_m = fix.estimate.pose.position_m.z();
      captures.frames.push_back(frames[i]);
    }
  }
  /// Replaces the detections of the check by those of a camera with another lens or tilt.
  void set_camera(const Lens& other, const Eigen::Matrix3d& other_from_camera) {
    const Lens lens(calibration.camera.lens_model, calibration.camera.intrinsics);
    for (Frame& frame : check.frames) {
      for (Detection& lamp : frame.detections) {
        const auto ray = lens.unproject(lamp.pixel);
        ASSERT_TRUE(ray);
        const auto pixel = other.project(other_from_camera * ray->direction);
        ASSERT_TRUE(pixel);
        lamp.pixel = *pixel;
      }
    }
  }
  PlacedCaptures reference, check;
};

TEST_F(OtherCamera, IsEmptyForTiltedUnit) {
  ASSERT_GT(check.frames.size(), 10U);
  set_camera(Lens(calibration.camera.lens_model, calibration.camera.intrinsics),
             Eigen::AngleAxisd(0.005, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix());
  EXPECT_EQ(find_other_focal_length(check, reference, map, calibration), "");
  EXPECT_EQ(find_other_lens(check.frames, reference.frames, map, calibration), "");
}

TEST_F(OtherCamera, IsReportedForDifferentFocalLength) {
  auto intrinsics = calibration.camera.intrinsics;
  intrinsics[0] *= 0.99;
  intrinsics[1] *= 0.99;
  set_camera(Lens(calibration.camera.lens_model, intrinsics), Eigen::Matrix3d::Identity());
  EXPECT_THAT(find_other_focal_length(check, reference, map, calibration),
              HasSubstr("its focal length differs, by heights that are off by "));
  reference.places.clear();
  EXPECT_EQ(find_other_focal_length(check, reference, map, calibration), "")
      << "no heights to compare";
}

TEST_F(OtherCamera, IsReportedForDifferentCenter) {
  auto intrinsics = calibration.camera.intrinsics;
  intrinsics[2] += 12;
  intrinsics[3] -= 8;
  set_camera(Lens(calibration.camera.lens_model, intrinsics), Eigen::Matrix3d::Identity());
  EXPECT_THAT(find_other_lens(check.frames, reference.frames, map, calibration),
              HasSubstr("its lens differs, by residuals of the lamps of "));
  EXPECT_EQ(find_other_lens(check.frames, {}, map, calibration), "") << "nothing to compare";
}

}  // namespace
}  // namespace vlp
