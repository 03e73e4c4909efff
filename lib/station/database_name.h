// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Whether records are on a server, postgresql://... or postgres://...; otherwise in a file.
bool is_server(const std::string& where);

/// Returns true if a connection string states a password.
bool states_password(const std::string& where);

/// The database for a message: a server without user and passwords, wherever they stand. Throws
/// InputError, which has no part of it that may be a password, when it is no connection string, or
/// could be misread as another: a '@', ':', '/' or '?' in user or password is %40, %3A, %2F or %3F.
std::string name_of_database(const std::string& where);

/// This machine's; empty when it has none.
std::string name_of_machine();

/// What tells databases apart, also for programs on other machines that share a folder: a file by
/// its machine and its whole path, MACHINE:/var/lib/vlp/records.db; a server by host, address
/// (hostaddr), port and database, or service, as libpq takes them, the environment's and its own
/// defaults included, and by its machine, too, when it is reached without a network. It has no
/// password, and the user's name only where that is the database's for want of another. Throws as
/// name_of_database().
std::string identity_of_database(const std::string& where);

/// What SOCI's PostgreSQL takes for a connection string. SOCI 4.0 reads one without a parameter as
/// the name of a database, and takes blanks and quotes for its own. It says how long to wait for
/// the server, patience_s(). Precondition: is_server().
std::string connection_of(const std::string& where);

/// Whether a server answers at all, whoever asks for whatever: one that refuses a password, or has
/// no TLS where it is asked for, does. Waits two seconds at most. Precondition: is_server().
bool answers(const std::string& where);

/// How long a database that does not answer is waited for, in seconds: a server as connect_timeout
/// says, a day at most, 0 (also for less) for ever, ten without it; a file that another program
/// writes, five.
int patience_s(const std::string& where);

}  // namespace vlp
