// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Returns true if the records are on a server (postgresql://... or postgres://...), false for a
/// file.
bool is_server_address(const std::string& where);

/// Returns true if `where` is a server address (postgresql://...) that contains a password. Returns
/// false for a file, for a connection string of keywords, and for an address that libpq cannot
/// parse.
bool contains_password(const std::string& where);

/// Returns the name of a database for messages. A server is named without user and passwords,
/// wherever they are in the connection string.
///
/// Throws InputError if `where` is no connection string or is ambiguous. In user and password '@',
/// ':', '/' and '?' are written %40, %3A, %2F and %3F. The error quotes no part that could be a
/// password.
std::string describe_database(const std::string& where);

/// Returns the host name of this machine; empty if it has none.
std::string get_host_name();

/// Returns an identity of a database that is unique also among machines that share a folder. It
/// contains no password.
///
///   file     MACHINE:/var/lib/vlp/records.db, the machine and the absolute path
///   server   host, address (hostaddr), port and database, or service, as libpq resolves them,
///            including its environment variables and its defaults
///
/// A server that is reached without a network has the machine, too. The user's name is included
/// only if it is the name of the database because none is given. Throws as describe_database().
std::string derive_identity(const std::string& where);

/// Returns a connection string for SOCI's PostgreSQL backend, with the connection timeout
/// get_timeout_s(). SOCI 4.0 reads a string without a parameter as a database name and
/// interprets blanks and quotes itself. Precondition: is_server_address().
std::string make_soci_string(const std::string& where);

/// Returns true if a server answers, regardless of user and database. A server that refuses a
/// password, or does not support the requested TLS, answers, too. Waits at most two seconds.
/// Precondition: is_server_address().
bool is_server_responding(const std::string& where);

/// Returns the maximum time to wait for a database that does not answer, s. For a server
/// connect_timeout applies, at most one day; 0 or less means no limit; the default is 10 s. For a
/// file that another program writes it is 5 s.
int get_timeout_s(const std::string& where);

}  // namespace vlp
