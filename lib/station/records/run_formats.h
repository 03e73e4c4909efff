// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// Run and derive_database_identity() of the records that it belongs to.
struct SpooledRun {
  RunRecord run;
  std::string records;
};

/// Serializes a run as JSON text in format `vlp-run/1`. The object has "records" (identity of its
/// database), the texts of list_run_text_fields(), "figures" (metrics), "images" and "events".
/// Figures with a guard band have "uncertainty" and "guard_k". Control characters and bytes that
/// are not UTF-8 are escaped (escape_run_texts()).
std::string serialize_run(const SpooledRun& spooled);
/// Reads a run in the format of serialize_run(). A missing text of list_run_text_fields() is empty,
/// as in files of older programs. Throws InputError with the file. Also throws it for a run without
/// a verdict, or if the name of run, camera or event is not a valid Id.
SpooledRun read_spooled_run(const std::filesystem::path& file);

/// Returns a run as a JSON object for the hook: "event" ("verdict", or "voided" for a voided run),
/// then the members written by export_runs_to_file().
std::string format_hook_json(const RunRecord& run);

/// Writes runs atomically, in the format of the file's extension. Throws InputError, also for
/// another extension.
///
///   .csv   one row per run: the texts of list_run_text_fields() with RunField::in_csv, and one
///          column per metric, empty if missing
///   .json  list of objects: the texts of list_run_text_fields(), "figures", "images" and "events".
///          "figures" has value, unit, gate and result of the gate of each metric by its name. With
///          a guard band it also has its uncertainty, factor and conformance probability.
void export_runs_to_file(const std::filesystem::path& file, const std::vector<RunRecord>& runs);

}  // namespace vlp
