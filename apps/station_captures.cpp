// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station_captures.h"

#include <spdlog/spdlog.h>

#include <filesystem>
#include <stdexcept>

#include "app.h"
#include "captures/captures_table.h"
#include "rig/input_error.h"

namespace vlp {

void add_station_options(CLI::App& app, StationOptions& options) {
  auto* station = app.add_option("--station", options.station_m, "Where the camera is in the world")
                      ->check(finite())
                      ->option_text("X_M Y_M");
  app.add_option("--captures", options.table,
                 "captures.csv: image, x_m, y_m (where the camera is) [, roll_rad, pitch_rad]; "
                 "default: captures.csv in the folder")
      ->excludes(station);
}

std::string captures_file(const StationOptions& options, const std::string& folder) {
  if (!options.table.empty()) return options.table;
  const auto beside = std::filesystem::path(folder) / "captures.csv";
  return std::filesystem::exists(beside) ? beside.string() : "";
}

std::vector<StationCapture> at_station(const std::vector<Frame>& frames,
                                       const StationOptions& options, const std::string& file) {
  const CapturesTable table = file.empty() ? CapturesTable{} : read_captures(file);
  std::vector<StationCapture> captures;
  for (const Frame& frame : frames) {
    const auto entry = table.find(frame.image);
    const Capture known = entry == table.end() ? Capture{} : entry->second;
    if (const auto& station_m = options.station_m) {
      captures.push_back({frame.detections, {(*station_m)[0], (*station_m)[1]}, known.inclination});
    } else if (known.x_m && known.y_m) {
      captures.push_back({frame.detections, {*known.x_m, *known.y_m}, known.inclination});
    }
  }
  if (captures.empty()) {
    const char* problem =
        "tells no place of these captures: it needs x_m and y_m, and the names of the images; "
        "or give --station";
    if (file.empty())
      throw std::invalid_argument("where is the station? Give --station or --captures");
    throw InputError(file, problem);
  }
  if (captures.size() < frames.size()) {
    spdlog::warn("{} of {} captures left out: {} does not tell their place",
                 frames.size() - captures.size(), frames.size(), file);
  }
  return captures;
}

}  // namespace vlp
