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

/// Checks that the clock is not years ahead, by which all runs seem to be kept no longer: the
/// station was used within the last year by it. Throws InputError. A clock by which a run was
/// recorded cannot be told from a right one.
void check_clock(const StationConfig& config, Records& records);

/// Deletes the folder of a run; links below `config.captures` and `config.results` are not
/// followed. Its record tells of it as soon as nothing is in the folder, which goes last, so that a
/// program that is killed before it has told of it finds the folder again. Throws InputError.
void delete_expired(const ExpiredFolder& expired, const StationConfig& config, Spool& spool);

}  // namespace vlp
