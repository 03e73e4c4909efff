// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Photographs without lamps: a board on a screen, with icons and letters around it.
#include <gtest/gtest.h>

#include <utility>

#include "detection/image_file.h"
#include "detection/lamp_detector.h"
#include "support/real_data.h"

namespace vlp {
namespace {

TEST(RealPictures, WithoutLampsShowNone) {
  const auto folder = real_data("apriltag-lattice-phone");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  LampMap map;
  for (const double frequency_hz : {2000.0, 2500.0, 3012.0, 3521.0, 3968.0}) {
    const int id = static_cast<int>(map.lamps.size()) + 1;
    map.lamps.push_back({id, {0.5 * id, 0, 2}, 0.15, frequency_hz, {}});
  }
  // Each of them has something that is striped like one of these lamps.
  for (const auto& [name, readout] : {std::pair("image_10.jpg", Readout::rows),
                                      {"image_4.jpg", Readout::columns},
                                      {"image_9.jpg", Readout::rows}}) {
    const LampDetector detector(map, {readout, 15.1e-6, {}});
    for (const Light& light : detector.detect(read_image(folder / name))) {
      EXPECT_FALSE(light.lamp) << name << " at " << light.pixel.transpose();
    }
  }
}

}  // namespace
}  // namespace vlp
