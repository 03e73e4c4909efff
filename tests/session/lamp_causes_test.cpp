// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lamp_causes.h"

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "camera/lens.h"
#include "positioning/positioner.h"
#include "support/example_rig.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

testing::Matcher<LampCause> IsCause(LampCauseKind kind, const std::string& text) {
  return AllOf(Field("kind", &LampCause::kind, kind),
               Field("text", &LampCause::text, HasSubstr(text)));
}

/// Returns the number that follows a text.
double number_after(const std::string& text, const std::string& before) {
  const auto at = text.find(before);
  EXPECT_NE(at, std::string::npos) << text;
  return at == std::string::npos ? NAN : std::stod(text.substr(at + before.size()));
}

/// The captures of the example in three steps, with the positions of their fixes in the last two.
struct LampCauses : ExampleRig {
  LampCauses() {
    const Positioner positioner(map, calibration);
    steps = {{"rotation", {}}, {"dispersion", {}}, {"check", {}}};
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Fix fix = positioner.compute_position_fix(frames[i].detections);
      if (!fix.has_succeeded()) continue;
      StepCaptures& step = steps[i % 3];
      step.frames.push_back(frames[i]);
      if (i % 3 == 0) continue;
      Capture& capture = step.positions[frames[i].image];
      capture.x_m = fix.state.pose.position_m.x();
      capture.y_m = fix.state.pose.position_m.y();
      capture.z_m = fix.state.pose.position_m.z();
      yaws_rad[frames[i].image] = fix.state.pose.yaw_rad;
    }
  }
  /// Replaces the detections of a step by those of a camera with another lens or tilt.
  void set_camera(StepCaptures& step, const std::vector<double>& intrinsics,
                  const Eigen::Matrix3d& other_from_camera) {
    const Lens lens(calibration.camera.lens_model, calibration.camera.intrinsics);
    const Lens other(calibration.camera.lens_model, intrinsics);
    for (Frame& frame : step.frames) {
      for (Detection& lamp : frame.detections) {
        const auto ray = lens.unproject_pixel(lamp.pixel);
        ASSERT_TRUE(ray);
        const auto pixel = other.project_point(other_from_camera * ray->direction);
        ASSERT_TRUE(pixel);
        lamp.pixel = *pixel;
      }
    }
  }
  std::vector<LampCause> rank(const CauseOptions& options = {}) const {
    return rank_lamp_causes(steps, map, calibration, options);
  }
  std::vector<StepCaptures> steps;
  std::map<std::string, double> yaws_rad;
};

TEST_F(LampCauses, AreEmptyForConsistentCaptures) {
  ASSERT_GT(steps[2].frames.size(), 8U);
  EXPECT_THAT(rank(), IsEmpty());
  // A slightly different lens is not another lens.
  calibration.camera.intrinsics[0] *= 1.0002;
  calibration.camera.intrinsics[2] += 0.1;
  EXPECT_THAT(rank(), IsEmpty());
}

TEST_F(LampCauses, AreEmptyForNoiseOfTwiceTheStatedDeviation) {
  const std::vector<StepCaptures> exact = steps;
  std::mt19937 random(11);
  constexpr int draws = 20;
  for (int draw = 0; draw < draws; ++draw) {
    steps = exact;
    for (StepCaptures& step : steps) {
      for (Frame& frame : step.frames) {
        for (Detection& lamp : frame.detections) {
          std::normal_distribution<double> noise(0, 2 * lamp.sigma_px.value_or(0.1));
          lamp.pixel += Eigen::Vector2d(noise(random), noise(random));
        }
      }
    }
    ASSERT_THAT(rank(), IsEmpty()) << draw;
  }
}

TEST_F(LampCauses, NameDisplacedLampWithItsDisplacement) {
  for (Lamp& lamp : map.lamps) {
    const Eigen::Vector3d kept_m = lamp.position_m;
    lamp.position_m += Eigen::Vector3d(0.02, -0.01, 0);
    const auto causes = rank();
    ASSERT_FALSE(causes.empty()) << lamp.id;
    EXPECT_THAT(causes.front(),
                IsCause(LampCauseKind::moved_lamp,
                        fmt::format("lamp {} hangs 22 mm from where the map has it (x -20 mm, y "
                                    "+10 mm",
                                    lamp.id)));
    lamp.position_m = kept_m + Eigen::Vector3d(0, 0.006, 0);
    const auto small = rank();
    ASSERT_FALSE(small.empty()) << lamp.id;
    EXPECT_EQ(small.front().kind, LampCauseKind::moved_lamp);
    EXPECT_NEAR(number_after(small.front().text, fmt::format("lamp {} hangs ", lamp.id)), 6, 0.15);
    lamp.position_m = kept_m;
  }
}

TEST_F(LampCauses, NameTwoDisplacedLamps) {
  map.lamps[0].position_m.x() += 0.02;
  map.lamps[3].position_m.y() += 0.012;
  const auto causes = rank();
  ASSERT_GE(causes.size(), 2U);
  EXPECT_THAT(causes[0].text, StartsWith(fmt::format("lamp {} ", map.lamps[0].id)));
  EXPECT_THAT(causes[1].text, StartsWith(fmt::format("lamp {} ", map.lamps[3].id)));
}

TEST_F(LampCauses, IgnoreDisplacementWithinTheSurveyOfALamp) {
  for (Lamp& lamp : map.lamps) lamp.sd_m = 0.01;
  map.lamps[1].position_m.x() += 0.006;
  EXPECT_THAT(rank(), IsEmpty());
}

TEST_F(LampCauses, NameStepWhosePositionsAreShifted) {
  for (auto& [image, capture] : steps[2].positions) *capture.x_m += 0.005;
  EXPECT_THAT(rank(), ElementsAre(IsCause(LampCauseKind::wrong_positions,
                                          "the positions of the check are off by 5.0 mm")));
}

TEST_F(LampCauses, NameCameraThatMovedOrTiltedBeforeTheLastStep) {
  const auto kept = steps;
  for (auto& [image, capture] : steps[2].positions) {
    *capture.x_m -= 0.006 * std::cos(yaws_rad[image]);
    *capture.y_m -= 0.006 * std::sin(yaws_rad[image]);
  }
  auto causes = rank();
  ASSERT_THAT(causes, ElementsAre(IsCause(LampCauseKind::moved_camera, "in the check, it is")));
  EXPECT_NEAR(number_after(causes[0].text, "displaced by "), 6, 0.5);
  steps = kept;
  set_camera(steps[2], calibration.camera.intrinsics,
             Eigen::AngleAxisd(0.01, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix());
  causes = rank();
  ASSERT_THAT(causes, ElementsAre(IsCause(LampCauseKind::moved_camera, "in the check, it is")));
  EXPECT_NEAR(number_after(causes[0].text, "tilted by "), 0.573, 0.02);
}

TEST_F(LampCauses, NameKnownCameraThatMovedBeforeAllSteps) {
  for (StepCaptures& step : steps) {
    set_camera(step, calibration.camera.intrinsics,
               Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX()).toRotationMatrix());
  }
  EXPECT_THAT(rank(), IsEmpty()) << "the tilt is calibrated from these captures";
  EXPECT_THAT(rank({.camera_is_known = true}),
              ElementsAre(IsCause(LampCauseKind::moved_camera, "since it was calibrated")));
}

TEST_F(LampCauses, NameStepOfAnotherCamera) {
  auto intrinsics = calibration.camera.intrinsics;
  intrinsics[0] *= 0.98;
  intrinsics[1] *= 0.98;
  intrinsics[2] += 6;
  set_camera(steps[2], intrinsics, Eigen::Matrix3d::Identity());
  const auto causes = rank();
  ASSERT_FALSE(causes.empty());
  EXPECT_THAT(causes.front(),
              IsCause(LampCauseKind::other_camera, "the images of check are of another camera"));
}

TEST_F(LampCauses, NameLensThatDiffersFromThatOfTheBoards) {
  const double lamps_px = calibration.camera.focal_px().prod();
  calibration.camera.intrinsics[0] *= 1.02;
  calibration.camera.intrinsics[1] *= 1.02;
  const auto causes = rank();
  ASSERT_FALSE(causes.empty());
  EXPECT_THAT(causes.front(),
              IsCause(LampCauseKind::other_lens,
                      fmt::format("the boards a focal length of {:.1f} px",
                                  std::sqrt(calibration.camera.focal_px().prod()))));
  EXPECT_NEAR(number_after(causes.front().text, "the lamps fit a focal length of "),
              std::sqrt(lamps_px), 0.002 * std::sqrt(lamps_px));
}

TEST_F(LampCauses, AreEmptyForTooFewCaptures) {
  map.lamps[0].position_m.x() += 0.02;
  for (StepCaptures& step : steps) step.frames.resize(1);
  steps.pop_back();
  EXPECT_THAT(rank(), IsEmpty());
  EXPECT_THAT(rank_lamp_causes({}, map, calibration), IsEmpty());
}

struct MapContradictions : ExampleRig {};

TEST_F(MapContradictions, NameSwappedLamps) {
  for (std::size_t a = 0; a < map.lamps.size(); ++a) {
    for (std::size_t b = a + 1; b < map.lamps.size(); ++b) {
      LampMap swapped = map;
      std::swap(swapped.lamps[a].position_m, swapped.lamps[b].position_m);
      EXPECT_THAT(list_map_contradictions(frames, swapped, calibration),
                  ElementsAre(HasSubstr(fmt::format("{} and {} seem to be swapped", map.lamps[a].id,
                                                    map.lamps[b].id))))
          << a << " " << b;
    }
  }
}

TEST_F(MapContradictions, ExcludeDisplacedLamps) {
  map.lamps[1].position_m.x() += 0.03;
  EXPECT_THAT(list_map_contradictions(frames, map, calibration), IsEmpty());
}

TEST_F(MapContradictions, ExcludeLampThatIsNeverVisible) {
  const int id = map.lamps[2].id;
  for (Frame& frame : frames) {
    std::erase_if(frame.detections, [&](const Detection& lamp) { return lamp.lamp == id; });
  }
  EXPECT_THAT(list_map_contradictions(frames, map, calibration), IsEmpty());
  EXPECT_THAT(list_missing_lamps(frames, map),
              ElementsAre(HasSubstr(fmt::format("lamp {} is never visible", id))));
  EXPECT_THAT(list_missing_lamps(std::span(frames).first(2), map), IsEmpty()) << "too few to tell";
}

}  // namespace
}  // namespace vlp
