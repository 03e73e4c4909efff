// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

namespace vlp {

/// Makes the tables of the records when they are not there, the same in SQLite and PostgreSQL.
/// Throws soci::soci_error, and std::runtime_error for a database of another version.
void make_record_tables(soci::session& sql);

}  // namespace vlp
