// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numbers>

#include "frontend/mat_view.h"
#include "lamps/drawn_lamp.h"
#include "lamps/light_detector.h"

namespace vlp {
namespace {

const cv::Size kHiddenSize(200, 160);

LightDetector detector() {
  const LampMap map{{drawn_lamp(1, 8), drawn_lamp(2, 9.6), drawn_lamp(3, 11.5), drawn_lamp(4, 13.8),
                     drawn_lamp(5, 16.5)}};
  return {map, drawn_camera(kHiddenSize)};
}

struct Tally {
  int lamps = 0, found = 0;
};

/// Counts detections behind a bar of the given width, at many angles and offsets.
Tally tally(double width_of_diameter) {
  const LightDetector lamp_detector = detector();
  Tally tally;
  for (int degrees = 0; degrees < 180; degrees += 15) {
    for (const double offset : {-0.6, -0.3, 0.0, 0.3, 0.6}) {
      DrawnLamp lamp;
      lamp.stripes.phase = 0.13 * tally.lamps;
      const double diameter_px = 2 * lamp.radius_px;
      lamp.bar = DrawnBar{degrees * std::numbers::pi / 180, offset * lamp.radius_px,
                          width_of_diameter * diameter_px};
      const int id = tally.lamps % 2 == 0 ? 2 : 3;
      lamp.stripes.period_lines = id == 2 ? 9.6 : 11.5;
      ++tally.lamps;
      for (const Light& light : lamp_detector.detect_lights(
               to_image_view(render_lamps({lamp}, kHiddenSize, CV_8U, 0.5)))) {
        if (light.kind != LightKind::lamp) continue;
        SCOPED_TRACE(testing::Message() << "bar at " << degrees << " deg, " << offset
                                        << " off, as wide as " << width_of_diameter);
        EXPECT_EQ(*light.lamp, id);
        EXPECT_LT((light.pixel - lamp.center).norm(), !has_outline(light) ? 2 * light.sigma_px : 1);
        ++tally.found;
      }
    }
  }
  return tally;
}

TEST(LightDetector, ReportsOnlyCorrectLampsBehindOccludingBars) {
  int lamps = 0, found = 0;
  for (const double width : {0.05, 0.1, 0.2, 0.33}) {
    const Tally counts = tally(width);
    RecordProperty("found_behind_" + std::to_string(width), counts.found);
    lamps += counts.lamps;
    found += counts.found;
  }
  EXPECT_EQ(lamps, 240);
  EXPECT_GE(found, 0.6 * lamps);
  EXPECT_LE(found, lamps);
}

TEST(LightDetector, IdentifiesAndLocatesSingleLampWithoutOccluder) {
  const DrawnLamp lamp{.stripes = {.period_lines = 9.6}};
  const auto lights =
      detector().detect_lights(to_image_view(render_lamps({lamp}, kHiddenSize, CV_8U, 0.5)));
  ASSERT_EQ(lights.size(), 1U);
  EXPECT_EQ(lights[0].lamp, 2);
  EXPECT_LT((lights[0].pixel - lamp.center).norm(), 0.05);
}

}  // namespace
}  // namespace vlp
