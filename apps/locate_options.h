// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <optional>
#include <string>

#include "detect_folder.h"

namespace vlp {

/// Those of vlp-locate.
struct LocateOptions {
  DetectOptions detect;
  std::string captures;
  std::string correction = "all";
  std::optional<double> sigma_px;
  std::optional<double> inclination_sigma_deg;
  std::optional<std::array<double, 4>> camera_on_robot;
  bool one_lamp = false;
};

/// Adds them all.
void add_locate_options(CLI::App& app, LocateOptions& options);

}  // namespace vlp
