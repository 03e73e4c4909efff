// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Whether records are on a server, postgresql://... or postgres://...; otherwise in a file.
bool is_server(const std::string& where);

/// The database for a message: a server without user and passwords, wherever they stand. Throws
/// InputError, which has no part of it that may be a password, when it is no connection string, or
/// could be misread as another: a '@', ':', '/' or '?' in user or password is %40, %3A, %2F or %3F.
std::string name_of_database(const std::string& where);

/// What SOCI's PostgreSQL takes for a connection string. SOCI 4.0 reads one without a parameter as
/// the name of a database, and takes blanks and quotes for its own. It says how long to wait for
/// the server, patience_s(). Precondition: is_server().
std::string connection_of(const std::string& where);

/// How long a database that does not answer is waited for, in seconds: a server as connect_timeout
/// says, a day at most, 0 (also for less) for ever, ten without it; a file that another program
/// writes, five.
int patience_s(const std::string& where);

}  // namespace vlp
