// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <stop_token>
#include <string>
#include <thread>

#include "rig/input_error.h"

namespace vlp {

/// Closes a connection without progress for `timeout_s`. libpq waits forever for a frozen server,
/// which does not apply its own limits either. Has no effect on SQLite.
class ConnectionWatchdog {
 public:
  ConnectionWatchdog(soci::session& sql, int timeout_s);
  ~ConnectionWatchdog();
  ConnectionWatchdog(const ConnectionWatchdog&) = delete;
  ConnectionWatchdog& operator=(const ConnectionWatchdog&) = delete;

  /// Restarts the time limit.
  void on_progress() { last_ = Clock::now(); }
  bool has_timed_out() const { return has_timed_out_; }

 private:
  using Clock = std::chrono::steady_clock;

  void close_at_timeout(const std::stop_token& stop);

  std::chrono::seconds timeout_;
  std::atomic<Clock::time_point> last_ = Clock::now();
  std::atomic<bool> has_timed_out_ = false;
  int socket_ = -1;
  std::jthread thread_;
};

/// Connection to the database of records, whose tables it creates. A lost connection is opened
/// again. Errors are those of Records.
class RecordDatabase {
 public:
  explicit RecordDatabase(const std::string& where);

  soci::session& session() { return sql_; }
  /// Returns the name for messages, without passwords.
  const std::string& printable_name() const { return name_; }

  /// Runs an action, a second time after a lost connection. The action reports its progress to the
  /// watchdog.
  template <typename Action>
  auto run(const Action& action, int timeout_factor = 1) {
    const auto begun = Clock::now();
    try {
      try {
        return run_with_timeout(action, timeout_factor);
      } catch (const soci::soci_error&) {
        if (!is_ready_ || sql_.is_connected()) throw;
      }
      // A unit takes minutes, in which the server can restart or the network can fail.
      sql_.reconnect();
      run_with_timeout([&](ConnectionWatchdog&) { configure_connection(); }, timeout_factor);
      return run_with_timeout(action, timeout_factor);
    } catch (const InputError&) {
      throw;
    } catch (const std::exception& error) {
      throw_with_name(error, begun);
    }
  }

 private:
  using Clock = std::chrono::steady_clock;

  template <typename Action>
  auto run_with_timeout(const Action& action, int timeout_factor) {
    ConnectionWatchdog watch(sql_, timeout_factor * timeout_s_);
    try {
      return action(watch);
    } catch (const soci::soci_error&) {
      if (!watch.has_timed_out()) throw;
      throw_timed_out(timeout_factor * timeout_s_);
    }
  }

  void open_connection();
  void configure_connection();
  [[noreturn]] void throw_timed_out(int timeout_s) const;
  /// Throws an error with the name of the database.
  [[noreturn]] void throw_with_name(const std::exception& error, Clock::time_point begun) const;
  /// Throws the reason of a failed connection. A server that took longer than 2 s counts as
  /// unreachable.
  [[noreturn]] void throw_not_connected(std::string what, Clock::time_point begun) const;

  std::string where_, name_;
  int timeout_s_;
  soci::session sql_;
  /// True if the tables exist; from then on a lost connection is opened again.
  bool is_ready_ = false;
};

}  // namespace vlp
