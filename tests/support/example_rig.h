// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "support/datasets.h"

namespace vlp {

/// The example data: five lamps from 36 positions with 0.05 px noise.
struct ExampleRig : testing::Test {
  LampMap map = read_lamp_map(kExample + "lamps.yaml");
  Calibration calibration = read_calibration(kExample + "calibration.yaml");
  std::vector<Frame> frames = read_detections(kExample + "detections.csv");
};

}  // namespace vlp
