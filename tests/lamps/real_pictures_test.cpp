// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Photographs without lamps: boards on a screen, with icons and letters around, and printed ones.
#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/light_detector.h"
#include "support/real_data.h"

namespace vlp {
namespace {

LampMap map_of_five() {
  LampMap map;
  for (const double frequency_hz : {2000.0, 2500.0, 3012.0, 3521.0, 3968.0}) {
    const int id = static_cast<int>(map.lamps.size()) + 1;
    map.lamps.push_back({id, {0.5 * id, 0, 2}, make_disc_lamp_shape(0.15), frequency_hz, {}});
  }
  return map;
}

void expect_no_lamp(const std::filesystem::path& file, Readout readout, double row_time_s) {
  const LightDetector detector(map_of_five(), {readout, row_time_s, {}});
  for (const Light& light : detector.detect_lights(to_image_view(read_image(file)))) {
    EXPECT_FALSE(light.lamp) << file << " at " << light.pixel.transpose() << ", " << row_time_s;
  }
}

TEST(LightDetectorOnRealImages, ReportsNoLampsInPhotographsWithoutLamps) {
  const auto folder = real_data("apriltag-lattice-phone");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  // Each image contains an object with stripes like those of one of these lamps.
  for (const auto& [name, readout] : {std::pair("image_10.jpg", Readout::rows),
                                      {"image_4.jpg", Readout::columns},
                                      {"image_9.jpg", Readout::rows}}) {
    expect_no_lamp(folder / name, readout, 15.1e-6);
  }
}

TEST(LightDetectorOnRealImages, ReportsNoLampsOnBoardsForFourRowTimes) {
  const auto folder = real_data("kalibr-aprilgrid-stereo");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  for (const char* camera : {"cam0", "cam1"}) {
    const auto images = list_images(folder / camera);
    ASSERT_GT(images.size(), 1U) << camera;
    // Uses one image of four, to save time. One of the others has an object that matches a lamp
    // with column readout, at 8 and at 12 us: squares and gaps between tags, 2.54 periods in phase
    // along the scanlines.
    for (std::size_t i = 1; i < images.size(); i += 4) {
      for (const Readout readout : {Readout::rows, Readout::columns}) {
        for (const double row_time_s : {5e-6, 8e-6, 20e-6, 50e-6}) {
          expect_no_lamp(images[i], readout, row_time_s);
        }
      }
    }
  }
}

}  // namespace
}  // namespace vlp
