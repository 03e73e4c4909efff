// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

#include <optional>
#include <string>

#include "station/records/run_record.h"

namespace vlp {

/// Version of the tables, stored in vlp_schema.
inline constexpr int kSchemaVersion = 6;

/// Returns true if the database has the tables. Takes no lock, so that users without write
/// permission can call it.
/// @throws soci::soci_error, and std::runtime_error if the tables have another version
bool has_record_tables(soci::session& sql);

/// Advisory lock of PostgreSQL for creating tables ("vlp").
inline constexpr int kTableLockId = 0x766c70;

/// Creates the tables of the records, identical in SQLite and PostgreSQL, unless they exist. Runs
/// in one transaction and in one program at a time. Throws soci::soci_error, and std::runtime_error
/// for tables of another version.
void create_record_tables(soci::session& sql);

/// Loads the texts of a run (list_run_text_fields()) from tables of the current version;
/// std::nullopt if no run has this id. Throws soci::soci_error.
std::optional<RunRecord> load_run_text_fields(soci::session& sql, const std::string& run);
/// Loads a run with its metrics, images and events, with the names of metrics as they were stored;
/// std::nullopt if no run has this id.
std::optional<RunRecord> load_run_with_all_parts(soci::session& sql, const std::string& run);

}  // namespace vlp
