// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Real lamps in images of rolling-shutter cameras: dim and with a hole, and larger than the image.
#include <gtest/gtest.h>

#include <optional>

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

TEST(LightDetectorOnRealLamp, ReportsCutAndTruePeriodForLampThatFillsImage) {
  const auto folder = real_data("led-1khz-frame");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  constexpr double frequency_hz = 1000, row_time_s = 14.565e-6;
  for (const std::optional<double> known_row_time_s : {std::optional(row_time_s), {}}) {
    const LightDetector detector(LampMap{{Lamp{1, {0, 0, 1}, {}, frequency_hz, {}}}},
                                 {Readout::rows, known_row_time_s, {}});
    const auto lights =
        detector.detect_lights(to_image_view(read_image(folder / "frame_example.png")));
    ASSERT_EQ(lights.size(), 1);
    EXPECT_EQ(lights[0].kind, known_row_time_s ? LightKind::truncated : LightKind::unknown);
    EXPECT_NEAR(lights[0].stripes.period_lines * frequency_hz * row_time_s, 1, 0.003);
  }
}

}  // namespace
}  // namespace vlp
