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

/// Folder of a run whose retention time has expired.
struct ExpiredFolder {
  std::filesystem::path folder;
  /// Kind of the event that is added to the run after the deletion of the folder: kImagesDeleted or
  /// kResultsDeleted.
  const char* event_kind;
  /// Retention time, days.
  int days;
  std::uintmax_t bytes;
  RunRecord run;
};

struct RetentionResult {
  /// Folders to delete, by name, images first.
  std::vector<ExpiredFolder> expired;
  /// Folders of the same age without a run in the records; not deleted.
  std::vector<std::filesystem::path> folders_without_record;
  /// Folders of the same age that contain files named in station.yaml; not deleted.
  std::vector<std::filesystem::path> folders_in_use;
};

/// Finds the folders of a station's runs whose retention time has expired, by StationConfig::keep
/// and the end of each run in the records. The folders are those of images, CAPTURES/CAMERA.RUN,
/// and of results, RESULTS/CAMERA/RUN. Ignores other names, such as folders in which images still
/// arrive, runs of other stations, and symbolic links.
RetentionResult list_expired_folders(const StationConfig& config, Records& records);

/// Checks the clock, because all runs appear expired if it is years ahead. Ignores voided runs.
/// Throws InputError if the newest run of the station ended after the clock's time or more than a
/// year before it. Also throws it if the runs of the last seven days ended more than a year after
/// the previous ones. A wrong clock with which runs were recorded for more than seven days is not
/// detected.
void check_clock(const StationConfig& config, Records& records);

/// Deletes the folder of a run, without following links below `config.captures` and
/// `config.results`. The event is recorded when the folder is empty, and the folder itself is
/// deleted last. A program that is killed before the event is recorded therefore finds the folder
/// again. Throws InputError.
void delete_expired(const ExpiredFolder& expired, const StationConfig& config, Spool& spool);

}  // namespace vlp
