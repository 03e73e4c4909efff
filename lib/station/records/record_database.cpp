// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/record_database.h"

#include <fcntl.h>
#include <soci/postgresql/soci-postgresql.h>
#include <soci/sqlite3/soci-sqlite3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "station/database_name.h"
#include "station/records/record_errors.h"
#include "station/records/record_tables.h"

namespace vlp {
namespace {

/// Returns true if a later attempt can succeed: another program holds a lock, or the file cannot be
/// opened or read.
bool is_transient_error(const soci::soci_error& error) {
  if (const auto* file = dynamic_cast<const soci::sqlite3_soci_error*>(&error)) {
    constexpr int without_extension = 0xff;
    const int result = file->result() & without_extension;
    return result == SQLITE_BUSY || result == SQLITE_LOCKED || result == SQLITE_CANTOPEN ||
           result == SQLITE_IOERR;
  }
  const auto* server = dynamic_cast<const soci::postgresql_soci_error*>(&error);
  constexpr const char *lock_not_available = "55P03", *deadlock_detected = "40P01";
  return server != nullptr &&
         (server->sqlstate() == lock_not_available || server->sqlstate() == deadlock_detected);
}

/// Returns true if the server's user lacks the right for the statement.
bool lacks_privilege(const soci::soci_error& error) {
  const auto* server = dynamic_cast<const soci::postgresql_soci_error*>(&error);
  constexpr const char* insufficient_privilege = "42501";
  return server != nullptr && server->sqlstate() == insufficient_privilege;
}

}  // namespace

ConnectionWatchdog::ConnectionWatchdog(soci::session& sql, int timeout_s) : timeout_(timeout_s) {
  if (timeout_s <= 0 || sql.get_backend_name() != "postgresql") return;
  const auto* server = static_cast<soci::postgresql_session_backend*>(sql.get_backend());
  // Own descriptor: libpq closes its socket when the connection is lost, and its number can be
  // reused.
  socket_ = ::fcntl(PQsocket(server->conn_), F_DUPFD_CLOEXEC, 0);
  if (socket_ >= 0)
    thread_ = std::jthread([this](const std::stop_token& stop) { close_at_timeout(stop); });
}

ConnectionWatchdog::~ConnectionWatchdog() {
  if (socket_ < 0) return;
  thread_ = {};  // stops and joins
  ::close(socket_);
}

void ConnectionWatchdog::close_at_timeout(const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any stopped;
  while (!stop.stop_requested()) {
    const auto until = last_.load() + timeout_;
    if (Clock::now() >= until) {
      has_timed_out_ = true;
      ::shutdown(socket_, SHUT_RDWR);
      return;
    }
    stopped.wait_until(lock, stop, until, [] { return false; });
  }
}

RecordDatabase::RecordDatabase(const std::string& where)
    : where_(where), name_(describe_database(where)), timeout_s_(get_timeout_s(where)) {
  open_connection();
  const bool has_tables = run([&](ConnectionWatchdog& watch) {
    configure_connection();
    watch.on_progress();
    return has_record_tables(sql_);
  });
  if (!has_tables) run([&](ConnectionWatchdog&) { create_record_tables(sql_); });
  is_ready_ = true;
}

void RecordDatabase::open_connection() {
  if (!is_server_address(where_) && where_.find('"') != std::string::npos) {
    throw InputError(name_, "the name of a database cannot have a quote (\"): rename its folder");
  }
  const auto begun = Clock::now();
  try {
    if (is_server_address(where_)) {
      sql_.open(soci::postgresql, make_soci_string(where_));
    } else {
      sql_.open(soci::sqlite3, "dbname=\"" + where_ + "\" timeout=" + std::to_string(timeout_s_));
    }
  } catch (const std::exception& error) {
    throw_with_name(error, begun);
  }
}

void RecordDatabase::configure_connection() {
  if (sql_.get_backend_name() == "postgresql") {
    sql_ << "SET client_min_messages TO warning";
    // Ends before this program's time limit, so that the server reports what it waits for.
    constexpr int ms_per_timeout_s = 900;
    sql_ << "SET lock_timeout TO " + std::to_string(timeout_s_ * ms_per_timeout_s);
    // An idle transaction holds the trail for no longer than others wait for it.
    sql_ << "SET idle_in_transaction_session_timeout TO " +
                std::to_string(timeout_s_ * ms_per_timeout_s);
    // A program that waited for a lock sees the changes of the other.
    sql_ << "SET SESSION CHARACTERISTICS AS TRANSACTION ISOLATION LEVEL READ COMMITTED";
    // Committed data is on the disk, regardless of the server's settings.
    sql_ << "SET synchronous_commit TO on";
    return;
  }
  // Committed data is on the disk, including its folder. Otherwise a power failure could restore
  // the journal and remove a run. A second connection sees complete runs.
  sql_ << "PRAGMA synchronous = EXTRA";
  sql_ << "PRAGMA foreign_keys = ON";
  // A file that others made can have triggers and views.
  sql_ << "PRAGMA trusted_schema = OFF";
}

void RecordDatabase::throw_timed_out(int timeout_s) const {
  // [STATION-1] `has not answered`
  throw RecordsOffline(
      name_, "the server of the records has not answered for " + std::to_string(timeout_s) + " s");
}

void RecordDatabase::throw_with_name(const std::exception& error, Clock::time_point begun) const {
  const auto* of_database = dynamic_cast<const soci::soci_error*>(&error);
  if (of_database == nullptr) throw InputError(name_, error.what());
  std::string what = of_database->get_error_message();  // without the SQL
  std::replace_if(
      what.begin(), what.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
  if (name_.starts_with("postgresql://") && !sql_.is_connected())
    throw_not_connected(std::move(what), begun);
  if (lacks_privilege(*of_database))
    throw RecordsRefused(name_, "the user of the records lacks a right: " + what);
  if (is_transient_error(*of_database)) throw RecordsOffline(name_, "the records: " + what);
  throw InputError(name_, "the records: " + what);
}

void RecordDatabase::throw_not_connected(std::string what, Clock::time_point begun) const {
  const std::string soci = "Cannot establish connection to the database. ";
  if (what.starts_with(soci)) what.erase(0, soci.size());
  constexpr std::chrono::seconds soon(2);
  const bool refused = Clock::now() - begun < soon && is_server_responding(where_);
  // [STATION-1] `records cannot be reached` | no data are lost, but repeated images are not
  //   detected (event `unchecked`) | `--verbose` prints the server's message
  if (!refused) throw RecordsOffline(name_, "the server of the records cannot be reached: " + what);
  // [STATION-2] `answers, but refuses` | wrong user, password, database or TLS
  //   (`sslmode=require`) | correct `records` in `station.yaml`, or the server
  throw RecordsRefused(
      name_, "the server of the records answers, but refuses 'records' of station.yaml: " + what);
}

}  // namespace vlp
