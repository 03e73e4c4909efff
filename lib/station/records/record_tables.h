// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

namespace vlp {

/// Present version of the tables, which vlp_schema holds: it counts the migrations.
extern const int kSchemaVersion;

/// Whether the tables are those of the present version; looks without a lock. Throws as
/// make_record_tables().
bool has_record_tables(soci::session& sql);

/// The advisory lock of PostgreSQL behind which tables are made and changed ("vlp"). A program from
/// before it does not ask for it: of two that begin with an empty database at one moment it can
/// still make one fail, which then works when it is started again.
inline constexpr int kLockOfTables = 0x766c70;

/// Makes the tables of the records when they are not there, the same in SQLite and PostgreSQL, and
/// brings those of an earlier version up to date, wholly or not at all, one program at a time.
/// Throws soci::soci_error, and std::runtime_error for tables of a later version.
void make_record_tables(soci::session& sql);

}  // namespace vlp
