// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

#include <optional>
#include <string>

#include "station/records/run_record.h"

namespace vlp {

/// Current version of the tables, the number of migrations plus one, stored in vlp_schema.
extern const int kSchemaVersion;

/// Returns true if the tables in the database have the version kSchemaVersion of this program,
/// false if they have an earlier one or do not exist. Takes no lock, so that users without write
/// permission can call it.
/// @throws soci::soci_error, and std::runtime_error if the tables have a later version
bool has_current_schema_version(soci::session& sql);

/// Advisory lock of PostgreSQL for creating and migrating tables ("vlp"). Older programs do not
/// take it. If two programs start with an empty database at the same time, one of them can
/// therefore fail; a second start then succeeds.
inline constexpr int kTableLockId = 0x766c70;

/// Creates the tables of the records, identical in SQLite and PostgreSQL, or migrates tables of an
/// earlier version. Runs in one transaction and in one program at a time. Throws soci::soci_error,
/// and std::runtime_error for tables of a later version.
void create_or_migrate_record_tables(soci::session& sql);

/// Loads the texts of a run (list_run_text_fields()) from tables of the current version;
/// std::nullopt if no run has this id. Throws soci::soci_error.
std::optional<RunRecord> load_run_text_fields(soci::session& sql, const std::string& run);
/// Loads a run with its metrics, images and events, with the names of metrics as they were stored;
/// std::nullopt if no run has this id.
std::optional<RunRecord> load_run_with_all_parts(soci::session& sql, const std::string& run);

}  // namespace vlp
