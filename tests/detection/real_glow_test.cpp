// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Real bulbs that glow, in 33 Mpx of a phone that lay on the floor.
#include <gtest/gtest.h>

#include <map>

#include "detection/image_file.h"
#include "detection/lamp_detector.h"
#include "positioning/positioner.h"
#include "support/real_data.h"

namespace vlp {
namespace {

constexpr double kFocal_px = 5620, kRowTime_s = 1 / 47540.0;

Camera camera_of(const cv::Mat& image, Readout readout) {
  Camera camera;
  camera.id = "phone";
  camera.imager_px = {image.cols, image.rows};
  camera.lens_model = LensModel::pinhole;
  camera.intrinsics = {kFocal_px, kFocal_px, (image.cols - 1) / 2.0, (image.rows - 1) / 2.0};
  camera.row_time_s = kRowTime_s;
  camera.readout = readout;
  return camera;
}

struct Seen {
  LampMap map;
  Calibration calibration;
  std::map<int, Light> lamps;
};

Seen seen_in(const std::filesystem::path& folder, const char* name, Readout readout) {
  const cv::Mat image = read_image(folder / name);
  Seen seen;
  seen.map = read_lamp_map(folder / "lamps.yaml");
  seen.calibration.camera = camera_of(image, readout);
  const LampDetector detector(seen.map, detector_camera(seen.calibration));
  for (const Light& light : detector.detect(image)) {
    if (light.kind != LightKind::lamp) continue;
    EXPECT_FALSE(seen.lamps.contains(*light.lamp)) << "one lamp twice";
    seen.lamps[*light.lamp] = light;
    const double frequency_hz = 1 / (light.stripes.period_lines * kRowTime_s);
    EXPECT_NEAR(frequency_hz / *light.lamp, 1, 0.05) << "the ids are nominal frequencies";
  }
  return seen;
}

TEST(RealGlow, OfFiveLampsIsIdentifiedAndMakesAFix) {
  const auto folder = real_data("luxapose");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const Seen seen = seen_in(folder, "x_0_y_1.27.jpg", Readout::rows);
  std::vector<Detection> detections;
  for (const auto& [id, light] : seen.lamps) {
    EXPECT_TRUE(light.glows);
    detections.push_back({id, light.pixel, light.sigma_px});
  }
  ASSERT_EQ(detections.size(), 5U);
  const Fix fix = Positioner(seen.map, seen.calibration).locate(detections);
  ASSERT_TRUE(fix.ok()) << explanation_of(fix.status);
  EXPECT_EQ(fix.lamps, 5);
  const double distance_m = 2.46 - fix.estimate.pose.position_m.z();
  EXPECT_NEAR(distance_m, 2.45, 0.02);
  EXPECT_LT(fix.residual_px * distance_m / kFocal_px, 2e-3);
}

TEST(RealGlow, IsIdentifiedWhenColumnsAreRead) {
  const auto folder = real_data("luxapose");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const Seen seen = seen_in(folder, "2014-02-27--18-15-03-62.jpg", Readout::columns);
  EXPECT_EQ(seen.lamps.size(), 3U);
  for (const int id : {3000, 3500, 4000}) EXPECT_TRUE(seen.lamps.contains(id)) << id;
}

}  // namespace
}  // namespace vlp
