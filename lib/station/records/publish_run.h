// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "captures/shared_folder.h"
#include "report/report_picture.h"
#include "station/records/run_record.h"

namespace vlp {

/// Checks before a camera's run is begun that its results can be written: makes the folder, writes
/// a file, and compares the room. Throws InputError.
void check_results(const std::filesystem::path& results, const std::string& camera);

/// Returns the name of a run's calibration among its files, by its verdict: calibration.yaml,
/// failed-calibration.yaml, invalid-calibration.yaml, or voided-calibration.yaml.
const char* calibration_name(const RunRecord& record);

/// Renames calibration, report and certificate in RESULTS/CAMERA/RUN/ to voided-calibration.yaml,
/// voided-report.html and voided-certificate.html, so that nobody takes them for valid. Skips files
/// that do not exist. Returns true if it renamed any. Throws InputError.
bool mark_files_voided(const RunRecord& record, const std::filesystem::path& results);

/// Report that exists already: a run that is published again keeps it, with its pictures. `restore`
/// replaces it by the record's and keeps it as replaced-report.html.
enum class ExistingReport { keep, replace };

/// Opens RESULTS/CAMERA/RUN/, and makes it if it does not exist. Throws InputError, also if camera
/// or run is no id.
SharedFolder open_run_folder(const RunRecord& record, const std::filesystem::path& results);

/// Writes the files of RESULTS/CAMERA/RUN/ that are missing, and returns the folder: the
/// calibration, if there is one, as calibration_name(); then report.html, which without `pictures`
/// has none. Can be repeated at any time. Throws InputError, also if the calibration exists and
/// differs from the record's.
std::filesystem::path publish_run(const RunRecord& record,
                                  const std::vector<ReportPicture>& pictures,
                                  const std::filesystem::path& results,
                                  ExistingReport existing = ExistingReport::keep);

}  // namespace vlp
