// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

namespace vlp {

/// Makes the tables of the records when they are not there, the same in SQLite and PostgreSQL, and
/// brings those of an earlier version up to date, wholly or not at all. Those of the present
/// version are only read. Throws soci::soci_error, and std::runtime_error for tables of a later
/// version.
void make_record_tables(soci::session& sql);

}  // namespace vlp
