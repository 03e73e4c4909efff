// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/lamp_detector.h"

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>

#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/light_detector.h"

namespace vlp {
namespace {

using testing::HasSubstr;

const std::string kRendered = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/";

LampMap lamp_map() { return read_lamp_map(kRendered + "lamps.yaml"); }
Calibration calibration() { return read_calibration(kRendered + "true_calibration.yaml"); }
cv::Mat sample() { return read_image(kRendered + "sample/0000.png"); }

TEST(LampDetector, DetectReturnsSameLampsAsLightDetector) {
  const cv::Mat image = sample();
  const auto lamps = LampDetector(lamp_map(), calibration()).detect_lamps(to_image_view(image));
  ASSERT_EQ(lamps.size(), 6U);
  std::size_t i = 0;
  const LightDetector lights(lamp_map(), make_detector_camera(calibration()));
  for (const Light& light : lights.detect_lights(to_image_view(image))) {
    if (light.kind != LightKind::lamp) continue;
    ASSERT_LT(i, lamps.size());
    EXPECT_EQ(lamps[i].lamp, light.lamp);
    EXPECT_EQ(lamps[i].pixel, light.pixel);
    EXPECT_EQ(lamps[i++].sigma_px, light.sigma_px);
  }
  EXPECT_EQ(i, lamps.size());
}

TEST(LampDetector, ThrowsForImageOfWrongSizeStrideOrBitDepthAndWithoutRowTime) {
  const cv::Mat image = sample();
  const LampDetector detector(lamp_map(), calibration());
  const auto format_failure_message = [&](const auto& change) -> std::string {
    ImageView view = to_image_view(image);
    change(view);
    try {
      detector.detect_lamps(view);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(format_failure_message([](ImageView&) {}), "none");
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.data = nullptr; }),
              HasSubstr("no pixels"));
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.width = 799; }),
              HasSubstr("799 x 600"));
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.height = -1; }),
              HasSubstr("800 x -1"));
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.stride = 799; }),
              HasSubstr("stride"));
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.stride = -800; }),
              HasSubstr("stride"));
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.bits = 16; }), HasSubstr("stride"));
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.bits = 12; }),
              HasSubstr("12 bits"));
  EXPECT_THAT(format_failure_message([](ImageView& view) { view.bits = 16, view.stride = 1601; }),
              HasSubstr("odd addresses"));
  Calibration without = calibration();
  without.camera.row_time_s.reset();
  EXPECT_THROW(LampDetector(lamp_map(), without), std::invalid_argument);
}

}  // namespace
}  // namespace vlp
