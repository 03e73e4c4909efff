// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/dispersion/dispersion.h"
#include "captures/detections_table.h"

namespace vlp {

/// Where the camera was.
struct StationOptions {
  /// A captures.csv; empty: that in the folder of the images.
  std::string table;
  std::optional<std::array<double, 2>> station_m;
};

/// Adds --station and --captures.
void add_station_options(CLI::App& app, StationOptions& options);

/// captures.csv: the one named, or that in the folder of the images; empty when there is none.
std::string captures_file(const StationOptions& options, const std::string& folder);

/// The captures whose place is known, by the options or by the table `file`, with a warning of the
/// others. Throws InputError, or std::invalid_argument without a table, when there is none.
std::vector<StationCapture> at_station(const std::vector<Frame>& frames,
                                       const StationOptions& options, const std::string& file);

}  // namespace vlp
