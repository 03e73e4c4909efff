// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "station/records/records.h"
#include "station/records/spool.h"
#include "station/station_config.h"

namespace vlp {

/// A folder of a run that is kept no longer.
struct ExpiredFolder {
  std::filesystem::path folder;
  /// kImagesDeleted or kResultsDeleted, once it is.
  const char* what;
  /// As long as it is kept.
  int days;
  std::uintmax_t bytes;
  RunRecord run;
};

struct Retained {
  /// By name, images first.
  std::vector<ExpiredFolder> expired;
  /// As old, but of no run of the records: left.
  std::vector<std::filesystem::path> without_record;
  /// As old, but with something in them that station.yaml names: left.
  std::vector<std::filesystem::path> in_use;
};

/// What of a station's runs is kept no longer, by StationConfig::keep and the end of each run as
/// the records have it: images that were put away, CAPTURES/CAMERA.RUN, and results,
/// RESULTS/CAMERA/RUN. What has another name, such as images that still arrive, is not looked at,
/// nor are runs of other stations and symbolic links.
Retained look_for_expired(const StationConfig& config, Records& records);

/// Checks the clock, because by one that is years ahead all runs are expired. Throws InputError if
/// the newest run of the station ended after the clock's time, or more than a year before it, and
/// if the runs of less than seven days ended more than a year after those before. Ignores voided
/// runs. Detects no clock by which runs were recorded for longer than these days.
void check_clock(const StationConfig& config, Records& records);

/// Deletes the folder of a run; links below `config.captures` and `config.results` are not
/// followed. Its record tells of it as soon as nothing is in the folder, which goes last, so that a
/// program that is killed before it has told of it finds the folder again. Throws InputError.
void delete_expired(const ExpiredFolder& expired, const StationConfig& config, Spool& spool);

}  // namespace vlp
