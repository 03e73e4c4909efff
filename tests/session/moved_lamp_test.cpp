// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Every step names a lamp that is not where the map has it, in the same words.
#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <numbers>

#include "calibration/adjustment/survey.h"
#include "session/adjust_step.h"
#include "session/dispersion_step.h"
#include "session/locate_step.h"
#include "session/rotation_step.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

/// The captures of a session in a room with six lamps. Lamp 2 hangs `moved_m` from its place in the
/// map.
class MovedLamp : public testing::Test {
 protected:
  void take_captures(const Eigen::Vector2d& moved_m) {
    rig.map.lamps[1].position_m.head<2>() += moved_m;
    turn({0.05, 0.02, 0}, 12, rotation.frames);
    turn({0.05, 0.02, 0.3}, 12, rotation.frames);
    turn({0, 0, 0}, 40, dispersion.frames);
    for (int i = 0; i < 36; ++i) turn({0.2 * (i % 6) - 0.5, 0.12 * (i / 6) - 0.3, 0}, 3, check);
    dispersion.calibration.rotation_center = rig.calibration.rotation_center;
  }

  void turn(const Eigen::Vector3d& place_m, int count, std::vector<Frame>& frames) {
    for (int i = 0; i < count; ++i) {
      rig.camera = {place_m, 2 * std::numbers::pi * (i + 0.1 * random.uniform(0, 1)) / count};
      std::vector<Detection> seen = with_noise(seen_from(rig, 0.006), random);
      const std::array<int, 2> imager_px = rig.calibration.camera.imager_px;
      std::erase_if(seen, [&](const Detection& one) {
        return one.pixel.minCoeff() < 0 || one.pixel.x() > imager_px[0] ||
               one.pixel.y() > imager_px[1];
      });
      frames.push_back({std::to_string(frames.size()), seen});
    }
  }

  StepResult rotate() const { return run_rotation_step(rotation, RotationMethod::axis, {}); }
  StepResult disperse() const {
    KnownPositions places;
    for (const Frame& frame : dispersion.frames) {
      places.captures.push_back({frame.detections, {0, 0}});
      places.measured_points.push_back(MeasuredPoint::camera);
    }
    return run_dispersion_step(dispersion, places, DispersionMethod::camera, DispersionCircle::mean,
                               {});
  }
  StepResult level() const { return run_tilt_step({check, map, kFile, camera}, false, {}); }
  StepResult locate() const { return locate_from_detections({check, map, dispersion.calibration}); }
  StepResult adjust() const {
    return run_adjust_step({{{"check", check, {}}}, map, kFile, camera, "camera.yaml", 1e-3, {}},
                           {});
  }

  static constexpr const char* kFile = "lamps.yaml";
  Random random{3};
  SyntheticRig rig{make_lamp_map({{-0.6, -0.3, 1.6},
                                  {0, -0.32, 1.6},
                                  {0.6, -0.3, 1.6},
                                  {-0.6, 0.3, 1.6},
                                  {0, 0.28, 1.6},
                                  {0.6, 0.3, 1.6}}),
                   {synthetic_camera(), {}, tilted_by(synthetic_camera(), 0.01, 1), {}, {}},
                   {},
                   {}};
  const LampMap map = rig.map;
  const Calibration camera{synthetic_camera(), {}, {}, {}, {}};
  LampCaptures rotation{{}, map, kFile, camera}, dispersion{{}, map, kFile, camera};
  std::vector<Frame> check;
};

/// Returns the warnings and, of a step that failed, the reason.
std::vector<std::string> collect_lines(const StepResult& result) {
  std::vector<std::string> lines = result.warnings;
  if (!result.has_succeeded()) lines.push_back(format_failure_message(result));
  return lines;
}

TEST_F(MovedLamp, AllStepsNameLampAndDisplacementOnce) {
  take_captures({-0.018, 0.024});
  const auto names_it = HasSubstr(
      "lamp 2 hangs 30 mm from where the map has it (x -18 mm, y +24 mm): moved, or entered "
      "wrongly");
  for (const StepResult& result : {rotate(), disperse(), level(), locate(), adjust()}) {
    SCOPED_TRACE(testing::PrintToString(collect_lines(result)));
    EXPECT_EQ(std::ranges::count_if(collect_lines(result),
                                    [](const std::string& line) {
                                      return line.find("lamp 2 ") != std::string::npos;
                                    }),
              1);
    EXPECT_THAT(collect_lines(result), Contains(names_it));
  }
}

TEST_F(MovedLamp, NoStepWarnsOfLampWhenMapIsCorrect) {
  take_captures({0, 0});
  for (const StepResult& result : {rotate(), disperse(), level(), locate(), adjust()}) {
    EXPECT_TRUE(result.has_succeeded()) << result.message;
    EXPECT_THAT(result.warnings, Each(Not(HasSubstr("lamp "))));
  }
}

TEST_F(MovedLamp, AdjustmentWarnsOfSetThatDoesNotRotateInPlace) {
  take_captures({0, 0});
  const AdjustStepResult result =
      run_adjust_step({{{"rotation", rotation.frames, {}, true}, {"check", check, {}, true}},
                       map,
                       kFile,
                       camera,
                       "camera.yaml",
                       1e-3,
                       {}},
                      {});
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.warnings, Contains(HasSubstr("check is not treated as a rotation in place")));
  EXPECT_THAT(result.warnings, Not(Contains(HasSubstr("rotation is not treated"))));
}

/// Captures of a large room tie few of its lamps together. The captures that fit a mirrored map by
/// chance must not pass for all.
TEST(RunTiltStep, FailsWithWrongMapForMirroredMapOfLargeRoom) {
  constexpr int rows = 10;
  constexpr double distance_m = 1.2, height_m = 2.5, focal_px = 520, noise_px = 0.05;
  LampCaptures input{{}, {}, "lamps.yaml", {}};
  Camera& camera = input.calibration.camera = synthetic_camera();
  camera.lens_model = LensModel::pinhole;
  camera.intrinsics = {focal_px, focal_px, 399.5, 299.5};
  for (int i = 0; i < rows * rows; ++i) {
    Lamp lamp;
    lamp.id = i + 1;
    lamp.position_m = {distance_m * (i / rows), distance_m * (i % rows), height_m};
    input.lamps.lamps.push_back(lamp);
  }
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d camera_m(random.uniform(0, rows * distance_m),
                                   random.uniform(0, rows * distance_m));
    const Eigen::Rotation2Dd turn(random.uniform(-3.1, 3.1));
    Frame frame{std::to_string(i), {}};
    for (const Lamp& lamp : input.lamps.lamps) {
      const Eigen::Vector2d from_camera_m = turn * (lamp.position_m.head<2>() - camera_m);
      Eigen::Vector2d pixel = focal_px / height_m * from_camera_m;
      pixel += Eigen::Vector2d(399.5, 299.5);
      if (pixel.minCoeff() < 0 || pixel.x() > 799 || pixel.y() > 599) continue;
      pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
      frame.detections.push_back({lamp.id, pixel, noise_px});
    }
    input.frames.push_back(frame);
  }
  EXPECT_TRUE(run_tilt_step(input, false, {}).has_succeeded());
  for (Lamp& lamp : input.lamps.lamps) lamp.position_m.y() *= -1;
  const TiltResult result = run_tilt_step(input, false, {});
  EXPECT_EQ(result.failure, StepFailure::wrong_map) << result.message;
}

}  // namespace
}  // namespace vlp
