// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Real lamp, dim and with a hole, in an image of a rolling-shutter camera.
#include <gtest/gtest.h>

#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/light_detector.h"
#include "support/real_data.h"

namespace vlp {
namespace {

TEST(LightDetectorOnRealLamp, ReturnsTruePeriodAndRadiusOfStripedLamp) {
  const auto folder = real_data("striped-lamp");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const LightDetector detector({}, {Readout::rows, {}, {}});
  const auto lights = detector.detect_lights(to_image_view(read_image(folder / "single_LED.bmp")));
  ASSERT_EQ(lights.size(), 1);
  EXPECT_NEAR(lights[0].stripes.period_lines, 10.1, 0.2);
  EXPECT_NEAR(lights[0].radius_px, 34.5, 1);
  EXPECT_EQ(lights[0].kind, LightKind::unknown) << "the map is empty";
}

}  // namespace
}  // namespace vlp
