// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// locate_from_detections(): lamps that are rejected, moved, unknown or outside the region
/// of the lens, and cameras that move.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "rig/calibration_error.h"
#include "session/locate_step.h"
#include "support/body_rig.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Captures of a level camera at rest, with all eight lamps visible.
struct Captures {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  LocateInput input{{}, rig.map, rig.calibration};

  explicit Captures(int count) {
    for (int i = 0; i < count; ++i) {
      rig.body.pose = {{0.02 * i - 0.1, -0.02 * i, 0}, 0.1 * i};
      input.frames.push_back({std::to_string(i) + ".png", seen_from(rig, 0.02)});
    }
  }
  Detection& detection(std::size_t frame, std::size_t index) {
    return input.frames[frame].detections[index];
  }
};

TEST(LocateFromDetections, ListsUsedLampsOutsideRegionOnly) {
  Captures captures(3);
  const int rejected = captures.detection(0, 0).lamp, used = captures.detection(0, 1).lamp;
  captures.detection(0, 0).pixel.x() += 50;
  captures.input.frames[0].detections.push_back({99, {400, 300}, 0.02});
  // A region beside the image, which contains no lamp.
  IntrinsicsReport& report = captures.input.calibration.intrinsics_report.emplace();
  report.region_px = {{-1, -1}, {-1, 0}, {0, 0}, {0, -1}};
  for (std::size_t i = 1; i < 3; ++i) captures.input.frames[i].detections.clear();
  const LocateResult found = locate_from_detections(captures.input);
  ASSERT_EQ(found.rows.size(), 3U);
  ASSERT_TRUE(found.rows[0].fix) << found.rows[0].status;
  EXPECT_THAT(found.rows[0].rejected_lamps, ElementsAre(rejected));
  const auto& outside = found.rows[0].lamps_outside_region;
  EXPECT_EQ(outside.size() + 2, captures.input.frames[0].detections.size());
  EXPECT_THAT(outside, Contains(used));
  EXPECT_THAT(outside, Not(Contains(rejected)));
  EXPECT_THAT(outside, Not(Contains(99)));
  EXPECT_THAT(found.rows[1].lamps_outside_region, IsEmpty()) << "no fix";
  EXPECT_THAT(found.warnings,
              Contains(testing::StartsWith("1 of 1 fixes use lamps outside the valid region")));
}

TEST(LocateFromDetections, CountsRejectionsOfEachLamp) {
  Captures captures(6);
  for (const std::size_t frame : {1U, 4U}) captures.detection(frame, 2).pixel.y() += 40;
  captures.detection(3, 1).pixel.x() -= 40;
  const int twice = captures.detection(1, 2).lamp, once = captures.detection(3, 1).lamp;
  ASSERT_EQ(captures.detection(4, 2).lamp, twice);
  const LocateResult found = locate_from_detections(captures.input);
  ASSERT_EQ(found.rejected_lamps.size(), 2U);
  const RejectedLamp& first = found.rejected_lamps[0];
  EXPECT_EQ(first.lamp, std::min(once, twice));
  EXPECT_EQ(first.captures, once < twice ? 1 : 2);
  const std::string lamp_twice = "lamp " + std::to_string(twice);
  EXPECT_THAT(found.warnings, Contains(testing::StartsWith(
                                  lamp_twice + " contradicts the other lamps in 2 of 6 captures")));
  EXPECT_THAT(found.warnings, Contains("1 detections that contradict the others, rejected"));
  EXPECT_THAT(found.details,
              Contains("1.png: " + lamp_twice + " contradicts the others and is rejected"));
  EXPECT_THAT(found.details,
              Contains("4.png: " + lamp_twice + " contradicts the others and is rejected"));
  ASSERT_EQ(found.rows.size(), 6U);
  EXPECT_THAT(found.rows[0].rejected_lamps, IsEmpty());
  EXPECT_THAT(found.rows[4].rejected_lamps, ElementsAre(twice));
}

TEST(LocateFromDetections, WarnsOfImagesThatTableLacks) {
  Captures captures(4);
  EXPECT_THAT(locate_from_detections(captures.input).warnings, IsEmpty()) << "no table";
  for (const Frame& frame : captures.input.frames) captures.input.captures[frame.image];
  EXPECT_THAT(locate_from_detections(captures.input).warnings, IsEmpty());
  captures.input.captures.erase("2.png");
  EXPECT_THAT(locate_from_detections(captures.input).warnings,
              ElementsAre(HasSubstr("1 of 4 images are not in captures.csv: image names have to be "
                                    "equal ('0.png' in the images, '0.png' in the table)")));
}

TEST(LocateFromDetections, WarnsOfLampsMovedSinceAdjustment) {
  Captures captures(6);
  std::vector<JointCovariance::LampPosition> lamps;
  for (const Lamp& lamp : captures.input.lamps.lamps) lamps.push_back({lamp.id, lamp.position_m});
  captures.input.calibration.rotation_center = tilted_by(captures.input.calibration.camera, 0, 0);
  captures.input.calibration.adjustment = Adjustment{{"made up"}, 1, 1, 0.1};
  captures.input.calibration.covariance = make_covariance(captures.input.calibration.camera, lamps,
                                                          MatrixX::Zero(12 + 4 + 24, 12 + 4 + 24));
  const auto count_warnings = [&] {
    return locate_from_detections(captures.input).warnings.size();
  };
  EXPECT_EQ(count_warnings(), 0U);
  captures.input.calibration.covariance->lamps[2].position_m.x() += 0.1;
  EXPECT_EQ(count_warnings(), 1U);
}

TEST(LocateFromDetections, FindsMovedLampOfTiltedRobot) {
  Captures captures(0);
  captures.rig.mount = CameraMount{{0, 0, 0}, 0.8};
  captures.input.positioner_options.mount = captures.rig.mount;
  captures.rig.map.lamps[1].position_m.x() += 0.03;
  for (int i = 0; i < 36; ++i) {
    const Inclination inclination{0.05 * ((i % 3) - 1), 0.04 * ((i % 5) - 2)};
    captures.rig.body = {{{0.02 * (i % 6) - 0.05, 0.02 * (i % 7), 0}, 0.3 * i},
                         {{0, 0}, 0, inclination}};
    const std::string image = std::to_string(i);
    captures.input.frames.push_back({image, seen_from(captures.rig, 0.05)});
    captures.input.captures[image].inclination = inclination;
  }
  EXPECT_THAT(
      locate_from_detections(captures.input).warnings,
      Contains(HasSubstr("lamp 2 hangs 30 mm from where the map has it (x +30 mm, y +0 mm)")));
}

/// Returns captures of a camera that drives at a speed, which the input does not state.
LocateInput make_drive(int count, double speed_m_per_s, double sigma_px) {
  Captures captures(0);
  captures.rig.body.motion.velocity_m_per_s = {speed_m_per_s, 0};
  for (int i = 0; i < count; ++i) {
    captures.rig.body.pose = {{0.02 * i - 0.1, -0.02 * i, 0}, 0.5 * i};
    captures.input.frames.push_back({std::to_string(i), seen_from(captures.rig, sigma_px)});
  }
  return captures.input;
}

TEST(LocateFromDetections, WarnsOfMotionOnlyIfResidualsDetermineIt) {
  const auto warning = HasSubstr("the images fit a moving camera, at 2 m/s: state velocities");
  EXPECT_THAT(locate_from_detections(make_drive(6, 2, 0.02)).warnings, Contains(warning));
  LocateInput few = make_drive(2, 2, 0.02);
  // Per frame 2 * 6 - 4 residuals at rest, of which velocity and yaw rate fit 3.
  for (Frame& frame : few.frames) frame.detections.resize(6);
  EXPECT_THAT(locate_from_detections(few).warnings, Not(Contains(HasSubstr("a moving"))));
}

TEST(LocateFromDetections, DoesNotWarnOfMotionAboveThreeMetersPerSecond) {
  EXPECT_THAT(locate_from_detections(make_drive(6, 2.8, 0.02)).warnings,
              Contains(HasSubstr("the images fit a moving camera, at 2.8 m/s")));
  EXPECT_THAT(locate_from_detections(make_drive(6, 4, 0.02)).warnings,
              Not(Contains(HasSubstr("a moving camera"))));
}

TEST(LocateFromDetections, DoesNotWarnOfMotionWithoutRowTime) {
  LocateInput input = make_drive(6, 2, 0.02);
  input.calibration.camera.row_time_s.reset();
  EXPECT_THAT(locate_from_detections(input).warnings, Not(Contains(HasSubstr("a moving camera"))));
}

TEST(LocateFromDetections, DoesNotWarnOfMotionThatExplainsNeitherResidualsNorFailures) {
  const auto warning = HasSubstr("a moving camera");
  EXPECT_THAT(locate_from_detections(make_drive(8, 1, 0.02)).warnings, Contains(warning));
  EXPECT_THAT(locate_from_detections(make_drive(8, 1, 3)).warnings, Not(Contains(warning)))
      << "residuals below the stated noise";
  LocateInput noisy = make_drive(8, 0, 0.02);
  Random random(4);
  for (Frame& frame : noisy.frames) {
    for (Detection& detection : frame.detections) {
      detection.pixel += 0.3 * Eigen::Vector2d(random.normal(), random.normal());
    }
  }
  const auto warnings = locate_from_detections(noisy).warnings;
  EXPECT_THAT(warnings, Contains(HasSubstr("px of noise, 0.02 px are stated")));
  EXPECT_THAT(warnings, Not(Contains(warning))) << "noise";
}

TEST(LocateFromDetections, WarnsOfMotionThatHalvesResiduals) {
  const auto find_residual_px = [](const LocateResult& result) {
    return 0.02 * find_metric_value(result.metrics, "residual_ratio").value_or(0);
  };
  LocateInput input = make_drive(8, 0.5, 0.02);
  const double motion_px = find_residual_px(locate_from_detections(input));
  ASSERT_GT(motion_px, 0.1);
  // Noise of motion_px / sqrt(r^2 - 1): the residuals at rest are r times the noise.
  for (const double ratio : {1.6, 2.5}) {
    const double noise_px = motion_px / std::sqrt(ratio * ratio - 1);
    LocateInput noisy = input;
    Random random(7);
    for (Frame& frame : noisy.frames) {
      for (Detection& detection : frame.detections) {
        detection.pixel += noise_px * Eigen::Vector2d(random.normal(), random.normal());
      }
    }
    const LocateResult found = locate_from_detections(noisy);
    EXPECT_NEAR(find_residual_px(found) / noise_px, ratio, 0.15 * ratio);
    const auto warnings = std::ranges::count_if(found.warnings, [](const std::string& line) {
      return line.find("a moving camera") != std::string::npos;
    });
    EXPECT_EQ(warnings, ratio > 2 ? 1 : 0) << ratio;
  }
}

TEST(LocateFromDetections, DoesNotWarnOfMotionOfCameraWhoseMotionIsStated) {
  LocateInput input = make_drive(8, 1, 0.02);
  input.captures["3"].velocity_m_per_s = Eigen::Vector2d(0, 0);
  EXPECT_THAT(locate_from_detections(input).warnings, Not(Contains(HasSubstr("a moving camera"))));
}

}  // namespace
}  // namespace vlp
