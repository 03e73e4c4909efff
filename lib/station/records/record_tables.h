// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

namespace vlp {

/// Current version of the tables, the number of migrations plus one, stored in vlp_schema.
extern const int kSchemaVersion;

/// Returns true if the tables have the current version. Takes no lock. Throws as
/// make_record_tables().
bool has_current_tables(soci::session& sql);

/// Advisory lock of PostgreSQL for creating and migrating tables ("vlp"). Older programs do not
/// take it. If two programs start with an empty database at the same time, one of them can
/// therefore fail; a second start then succeeds.
inline constexpr int kTableLockId = 0x766c70;

/// Creates the tables of the records, identical in SQLite and PostgreSQL, or migrates tables of an
/// earlier version. Runs in one transaction and in one program at a time. Throws soci::soci_error,
/// and std::runtime_error for tables of a later version.
void make_record_tables(soci::session& sql);

}  // namespace vlp
