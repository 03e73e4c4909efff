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

/// Checks, before a camera's run is started, that its results can be written: creates the folder,
/// writes a file, and checks the free space. Throws InputError.
void check_results_writable(const std::filesystem::path& results, const std::string& camera);

/// Returns the file name under which the calibration of a run is published. By its verdict it is
/// calibration.yaml (PASS), failed-calibration.yaml (FAIL) or invalid-calibration.yaml (INVALID). A
/// voided run has voided-calibration.yaml.
const char* calibration_file_name(const RunRecord& record);

/// Renames calibration, report and certificate in RESULTS/CAMERA/RUN/ to voided-calibration.yaml,
/// voided-report.html and voided-certificate.html, so that they cannot be mistaken for valid files.
/// Skips missing files. Returns true if it renamed any. Throws InputError.
bool rename_voided_files(const RunRecord& record, const std::filesystem::path& results);

/// Returns the report of a run (report.html): verdict and causes, gates, other metrics, the
/// calibration with its history, the plots of its steps, and the rejected images. `calibration` is
/// the file with the record's calibration; empty if there is none. Throws InputError.
std::string make_run_report(const RunRecord& record, const std::filesystem::path& calibration,
                            const std::vector<ReportPlot>& pictures);

/// Treatment of an existing report. A run that is published again keeps its report with its plots.
/// `replace` writes the record's report instead and keeps the old one as replaced-report.html.
enum class ExistingReport { keep, replace };

/// Opens RESULTS/CAMERA/RUN/, and creates it if it does not exist. Throws InputError, also if
/// camera or run is no valid id.
SharedFolder open_run_results(const RunRecord& record, const std::filesystem::path& results);

/// Writes the missing files of RESULTS/CAMERA/RUN/, and returns the folder. The files are the
/// calibration, if the run has one, as calibration_file_name(), and then report.html with
/// `pictures`. Can be repeated at any time. Throws InputError, also if the existing calibration
/// differs from the record's.
std::filesystem::path publish_run_files(const RunRecord& record,
                                        const std::vector<ReportPlot>& pictures,
                                        const std::filesystem::path& results,
                                        ExistingReport existing = ExistingReport::keep);

}  // namespace vlp
