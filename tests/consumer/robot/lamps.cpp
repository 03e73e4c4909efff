// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Stands in for the robot's lamp detector: one good image, one with a single lamp, no more.
#include <vlp/positioning/positioner.h>

#include <vector>

std::vector<vlp::Detection> lamps_in_next_image() {
  static int image = 0;
  const std::vector<vlp::Detection> lamps = {
      {1, {356.78, 261.11}, 0.05}, {2, {631.44, 285.44}, {}}, {5, {500, 350}, {}}};
  ++image;
  if (image == 1) return lamps;
  if (image == 2) return {lamps[0]};
  return {};
}
