// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Replaces the robot's camera: an image from standard input, then a dark one, then none.
#include <vlp/lamps/lamp_detector.h>

#include <cstdint>
#include <cstdio>
#include <vector>

vlp::ImageView next_image() {
  static int image = 0;
  static std::vector<std::uint8_t> pixels(800 * 600);
  ++image;
  if (image > 2) return {};
  if (image == 1 && std::fread(pixels.data(), pixels.size(), 1, stdin) != 1) return {};
  if (image == 2) pixels.assign(pixels.size(), 5);
  return {pixels.data(), 800, 600, 800, 8};
}
