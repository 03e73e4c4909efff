// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numbers>

#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"
#include "lamps/light_detector.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

const cv::Size kTouchingSize(300, 300);
constexpr double kPeriods_lines[] = {9.4, 13.1};

struct Touching {
  double gap_px, angle_rad, radius_ratio;
  int depth;
};

/// Returns true if both lamps are found.
bool locate_both(const Touching& touching) {
  const Vector2d direction(std::cos(touching.angle_rad), std::sin(touching.angle_rad));
  const double large_px = 38.4, small_px = large_px * touching.radius_ratio;
  const Vector2d middle(150.3, 149.6);
  const DrawnLamp first_lamp{.center = middle - large_px * direction,
                             .radius_px = large_px,
                             .stripes = {.period_lines = kPeriods_lines[0]}};
  const DrawnLamp second_lamp{.center = middle + (small_px + touching.gap_px) * direction,
                              .radius_px = small_px,
                              .stripes = {.period_lines = kPeriods_lines[1], .phase = 0.8}};
  const LampMap map{{drawn_lamp(1, kPeriods_lines[0]), drawn_lamp(2, kPeriods_lines[1])}};
  const LightDetector detector(map, drawn_camera(kTouchingSize));
  const auto lights = detector.detect_lights(
      to_image_view(render_lamps({first_lamp, second_lamp}, kTouchingSize, touching.depth, 0.5)));
  int lamps = 0;
  for (const Light& light : lights) {
    if (light.kind != LightKind::lamp) continue;
    ++lamps;
    const DrawnLamp& truth = *light.lamp == 1 ? first_lamp : second_lamp;
    EXPECT_LT((light.pixel - truth.center).norm(), 0.1) << "lamp " << *light.lamp;
    EXPECT_NEAR(light.radius_px, truth.radius_px, 0.35) << "lamp " << *light.lamp;
  }
  return lamps == 2 && lights.size() == 2;
}

TEST(LightDetector, IdentifiesBothOfTwoTouchingLamps) {
  int cases = 0, both = 0;
  for (const double gap_px : {0.0, 1.0, 2.0}) {
    for (const int degrees : {0, 30, 45, 60, 90, 120, 150, 180, 210, 270}) {
      for (const double radius_ratio : {1.0, 0.8}) {
        for (const int depth : {CV_8U, CV_16U}) {
          SCOPED_TRACE(testing::Message() << gap_px << " px between, " << degrees << " deg, "
                                          << radius_ratio << ", depth " << depth);
          ++cases;
          both +=
              locate_both({gap_px, degrees * std::numbers::pi / 180, radius_ratio, depth}) ? 1 : 0;
        }
      }
    }
  }
  EXPECT_EQ(cases, 120);
  EXPECT_GE(both, 118);
}

}  // namespace
}  // namespace vlp
