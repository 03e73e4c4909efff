// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/calibration_report.h"
#include "detect_folder.h"
#include "rig/calibration.h"

namespace vlp {

/// What vlp-intrinsics is asked for.
struct IntrinsicsOptions {
  std::vector<std::string> images;
  std::string board, output, cache, ros, kalibr, opencv, plot;
  std::string camera_id = "camera", lens = "LENSMODEL_OPENCV8";
  std::optional<Readout> readout;
  std::optional<double> row_time_s, pixel_pitch_m;
  int threads = all_cores();
  int held_out = 0;
  IntrinsicsGates gates;
};

/// Adds all of them to `app`; `options` outlives it.
void add_intrinsics_options(CLI::App& app, IntrinsicsOptions& options);

}  // namespace vlp
