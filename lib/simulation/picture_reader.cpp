// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/picture.h"
#include "simulation/scene_parts.h"

namespace vlp {

ImageProcessing read_image_processing(YamlMap map, const Sensor& sensor) {
  if (sensor.black_level_dn >= white_dn(sensor)) {
    throw map.error("needs levels between sensor.black_level_dn and white");
  }
  ImageProcessing picture;
  picture.gamma = map.required("gamma").number_within(0.1, 10, "(of the tone curve)");
  if (const auto sharpening = map.optional("sharpening")) {
    YamlMap keys = sharpening->map();
    picture.sharpening = Sharpening{keys.required("amount").number_within(0, 10, "(of the detail)"),
                                    keys.required("radius_px").number_within(0.3, 50, "px")};
    keys.finish();
  }
  if (const auto quality = map.optional("jpeg_quality")) {
    picture.jpeg_quality = quality->integer_within(1, 100);
    if (sensor.bits != 8) throw quality->error("JPEG has 8 bits: set sensor.bits to 8");
  }
  if (const auto bayer = map.optional("bayer")) {
    YamlMap keys = bayer->map();
    const auto fraction = [&](const char* key) {
      return keys.required(key).number_within(0.05, 2, "(of what green filters pass)");
    };
    const double red_share = fraction("red_share");
    picture.bayer = Bayer{red_share, fraction("blue_share")};
    keys.finish();
  }
  map.finish();
  return picture;
}

}  // namespace vlp
