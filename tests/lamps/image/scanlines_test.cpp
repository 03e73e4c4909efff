// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "frontend/mat_view.h"
#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

/// Compares positions by row, then by column of the scanlines.
bool before(const Light& a, const Light& b) {
  return a.pixel.x() != b.pixel.x() ? a.pixel.x() < b.pixel.x() : a.pixel.y() < b.pixel.y();
}

TEST(LightDetector, DetectsSameLightsInTransposedImageWithColumnReadout) {
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  // The sample for the background uses other pixels of a transposed image; they must have the same
  // levels.
  scene.ambient_e_per_s = 0;
  scene.sensor.shot_noise = false;
  scene.sensor.read_noise_e = 0;
  const FrameRenderer renderer(scene);
  const LampMap map = make_lamp_map(scene, false);
  const double row_time_s = *scene.camera.row_time_s;
  const LightDetector by_rows(map, {Readout::rows, row_time_s, std::nullopt});
  const LightDetector by_columns(map, {Readout::columns, row_time_s, std::nullopt});
  const CaptureSet& set =
      *std::find_if(scene.sets.begin(), scene.sets.end(),
                    [](const CaptureSet& any) { return any.folder == "check"; });
  for (std::size_t i = 0; i < 3; ++i) {
    const LampShot shot = make_lamp_shot(scene, set, i * 7);
    const cv::Mat image =
        simulate_sensor_image(scene.sensor, renderer.render_lamps(shot), shot.noise_seed);
    const auto upright = by_rows.detect_lights(to_image_view(image));
    auto turned = by_columns.detect_lights(to_image_view(image.t()));
    std::sort(turned.begin(), turned.end(), before);
    EXPECT_GE(upright.size(), 4U);
    ASSERT_EQ(upright.size(), turned.size());
    for (std::size_t j = 0; j < upright.size(); ++j) {
      EXPECT_LT((upright[j].pixel - turned[j].pixel.reverse()).norm(), 1e-5);
      EXPECT_NEAR(upright[j].sigma_px, turned[j].sigma_px, 1e-6);
      EXPECT_EQ(upright[j].lamp, turned[j].lamp);
      EXPECT_EQ(upright[j].kind, turned[j].kind);
      EXPECT_EQ(upright[j].stripes.period_lines, turned[j].stripes.period_lines);
    }
  }
}

}  // namespace
}  // namespace vlp
