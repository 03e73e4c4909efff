// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/records.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <soci/postgresql/soci-postgresql.h>
#include <soci/sqlite3/soci-sqlite3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/records/record_tables.h"

namespace vlp {
namespace {

/// Configures a new connection.
void configure_connection(soci::session& sql, int timeout_s) {
  if (sql.get_backend_name() == "postgresql") {
    sql << "SET client_min_messages TO warning";
    // Ends before this program's time limit, so that the server reports what it waits for.
    constexpr int ms_per_timeout_s = 900;
    sql << "SET lock_timeout TO " + std::to_string(timeout_s * ms_per_timeout_s);
    // An idle transaction holds the trail for no longer than others wait for it.
    sql << "SET idle_in_transaction_session_timeout TO " +
               std::to_string(timeout_s * ms_per_timeout_s);
    // A program that waited for a lock sees the changes of the other.
    sql << "SET SESSION CHARACTERISTICS AS TRANSACTION ISOLATION LEVEL READ COMMITTED";
    // Committed data is on the disk, regardless of the server's settings.
    sql << "SET synchronous_commit TO on";
    return;
  }
  // Committed data is on the disk, including its folder. Otherwise a power failure could restore
  // the journal and remove a run. A second connection sees complete runs.
  sql << "PRAGMA synchronous = EXTRA";
  sql << "PRAGMA foreign_keys = ON";
  // A file that others made can have triggers and views.
  sql << "PRAGMA trusted_schema = OFF";
}

void open_database_session(soci::session& sql, const std::string& where) {
  if (is_server_address(where)) {
    sql.open(soci::postgresql, make_soci_string(where));
  } else {
    if (where.find('"') != std::string::npos) {
      throw InputError(where, "the name of a database cannot have a quote (\"): rename its folder");
    }
    sql.open(soci::sqlite3,
             "dbname=\"" + where + "\" timeout=" + std::to_string(get_timeout_s(where)));
  }
}

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

/// Closes a connection without progress for get_timeout_s(). libpq waits forever for a
/// frozen server, which does not apply its own limits either.
class ConnectionWatchdog {
 public:
  ConnectionWatchdog(soci::session& sql, int timeout_s) : timeout_(timeout_s) {
    if (timeout_s <= 0 || sql.get_backend_name() != "postgresql") return;
    const auto* server = static_cast<soci::postgresql_session_backend*>(sql.get_backend());
    // Own descriptor: libpq closes its socket when the connection is lost, and its number can be
    // reused.
    socket_ = ::fcntl(PQsocket(server->conn_), F_DUPFD_CLOEXEC, 0);
    if (socket_ >= 0)
      thread_ = std::jthread([this](const std::stop_token& stop) { wait_before_retry(stop); });
  }
  ~ConnectionWatchdog() {
    if (socket_ < 0) return;
    thread_ = {};  // stops and joins
    ::close(socket_);
  }
  ConnectionWatchdog(const ConnectionWatchdog&) = delete;
  ConnectionWatchdog& operator=(const ConnectionWatchdog&) = delete;

  /// Restarts the time limit.
  void on_progress() { last_ = Clock::now(); }
  bool has_timed_out() const { return has_timed_out_; }

 private:
  using Clock = std::chrono::steady_clock;

  void wait_before_retry(const std::stop_token& stop) {
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

  std::chrono::seconds timeout_;
  std::atomic<Clock::time_point> last_ = Clock::now();
  std::atomic<bool> has_timed_out_ = false;
  int socket_ = -1;
  std::jthread thread_;
};

}  // namespace

struct Records::Database {
  /// `name` is for messages.
  std::string where, name;
  int timeout_s = 0;
  soci::session sql;

  /// True if the tables exist; from then on a lost connection is opened again.
  bool ready = false;

  /// Throws the reason of a failed connection. A server that took longer than 2 s counts as
  /// unreachable.
  [[noreturn]] void throw_not_connected(std::string what,
                                        std::chrono::steady_clock::time_point begun) const {
    const std::string soci = "Cannot establish connection to the database. ";
    if (what.starts_with(soci)) what.erase(0, soci.size());
    constexpr std::chrono::seconds soon(2);
    const bool refused =
        std::chrono::steady_clock::now() - begun < soon && is_server_responding(where);
    // [STATION-1] `records cannot be reached` | no data are lost, but repeated images are not
    //   detected (event `unchecked`) | `--verbose` prints the server's message
    if (!refused)
      throw RecordsOffline(name, "the server of the records cannot be reached: " + what);
    // [STATION-2] `answers, but refuses` | wrong user, password, database or TLS
    //   (`sslmode=require`) | correct `records` in `station.yaml`, or the server
    throw RecordsRefused(
        name, "the server of the records answers, but refuses 'records' of station.yaml: " + what);
  }

  /// Runs an action; its errors name the database.
  template <typename Action>
  auto with_database_name(const Action& action) {
    const auto begun = std::chrono::steady_clock::now();
    try {
      return action();
    } catch (const InputError&) {
      throw;
    } catch (const soci::soci_error& error) {
      std::string what = error.get_error_message();  // without the SQL
      std::replace_if(
          what.begin(), what.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
      if (name.starts_with("postgresql://") && !sql.is_connected())
        throw_not_connected(what, begun);
      if (lacks_privilege(error)) {
        throw RecordsRefused(name, "the user of the records lacks a right: " + what);
      }
      if (is_transient_error(error)) throw RecordsOffline(name, "the records: " + what);
      throw InputError(name, "the records: " + what);
    } catch (const std::exception& error) {
      throw InputError(name, error.what());
    }
  }

  /// Runs an action, a second time after a lost connection. The action reports its progress to the
  /// watch.
  template <typename Action>
  auto run(const Action& action, int timeout_factor = 1) {
    return with_database_name([&] {
      try {
        return run_with_timeout(action, timeout_factor);
      } catch (const soci::soci_error&) {
        if (!ready || sql.is_connected()) throw;
      }
      // A unit takes minutes, in which the server can restart or the network can fail.
      sql.reconnect();
      run_with_timeout([&](ConnectionWatchdog&) { configure_connection(sql, timeout_s); },
                       timeout_factor);
      return run_with_timeout(action, timeout_factor);
    });
  }

 private:
  template <typename Action>
  auto run_with_timeout(const Action& action, int timeout_factor) {
    ConnectionWatchdog watch(sql, timeout_factor * timeout_s);
    try {
      return action(watch);
    } catch (const soci::soci_error&) {
      if (!watch.has_timed_out()) throw;
      // [STATION-1] `has not answered`
      throw RecordsOffline(name, "the server of the records has not answered for " +
                                     std::to_string(timeout_factor * timeout_s) + " s");
    }
  }
};

namespace {

/// Factor of the time limit for many rows: the server collects them before it sends the first one.
constexpr int kManyRowsTimeoutFactor = 10;

/// Stores the rows of a run. Returns false if the run exists.
bool insert_run(soci::session& sql, const std::string& run, const RunRows& rows,
                const std::string& destination, ConnectionWatchdog& watch) {
  soci::statement insert(sql);
  std::string places;
  for (const std::string& column : rows.columns) {
    places.append(":c").append(std::to_string(places.size())).append(", ");
    insert.exchange(soci::use(column));
  }
  insert.exchange(soci::use(rows.document));
  insert.exchange(soci::use(destination));
  insert.alloc();
  insert.prepare("INSERT INTO runs VALUES (" + places +
                 ":document, :destination) ON CONFLICT (run) DO NOTHING");
  insert.define_and_bind();
  insert.execute(true);
  watch.on_progress();
  if (insert.get_affected_rows() == 0) return false;
  for (const auto& [name, metric] : rows.metrics) {
    const double value = metric.first.value_or(0), gate = metric.second.value_or(0);
    soci::indicator has_value = metric.first ? soci::i_ok : soci::i_null,
                    has_gate = metric.second ? soci::i_ok : soci::i_null;
    sql << "INSERT INTO metrics VALUES (:run, :name, :value, :gate)", soci::use(run),
        soci::use(name), soci::use(value, has_value), soci::use(gate, has_gate);
    watch.on_progress();
  }
  for (const std::string& sha256 : rows.image_sha256) {
    sql << "INSERT INTO images VALUES (:run, :sha256)", soci::use(run), soci::use(sha256);
    watch.on_progress();
  }
  return true;
}

/// Returns true if the stored run has this document. A stored one is written again first, because
/// another version of the program can have written it.
bool has_stored_document(soci::session& sql, const std::string& run, const std::string& document) {
  const auto kept = load_run(sql, run);
  return kept && serialize_run(*kept) == document;
}

/// Stores the new events, and returns them.
std::vector<RunEvent> insert_events(soci::session& sql, const RunRecord& record,
                                    ConnectionWatchdog& watch) {
  std::vector<RunEvent> added;
  for (const RunEvent& event : record.events) {
    soci::statement insert =
        (sql.prepare << "INSERT INTO events (event, run, what, text, who) VALUES (:event, :run, "
                        ":what, :text, :who) ON CONFLICT (event) DO NOTHING",
         soci::use(event.event), soci::use(record.run), soci::use(event.kind),
         soci::use(event.text), soci::use(event.author));
    insert.execute(true);
    if (insert.get_affected_rows() > 0) added.push_back(event);
    watch.on_progress();
  }
  return added;
}

/// Conditions for a run in a query.
const std::string kNotVoided =
    "NOT EXISTS (SELECT 1 FROM events WHERE events.run = runs.run AND events.what = 'voided')";
/// As is_hook_pending().
const std::string kHookOpen = fmt::format(
    "EXISTS (SELECT 1 FROM events WHERE events.run = runs.run AND events.what = '{}' AND "
    "NOT EXISTS (SELECT 1 FROM events ended WHERE ended.run = events.run AND ended.what = '{}' "
    "AND ended.event > events.event))",
    kHookRequested, kHookDone);

/// Returns the conditions of a filter, and binds their values in this order.
std::string bind_filter(soci::statement& statement, const RunFilter& filter) {
  std::string text = "WHERE 1 = 1";
  const auto add = [&](const std::string& value, const char* condition) {
    if (value.empty()) return;
    text.append(" AND ").append(condition);
    statement.exchange(soci::use(value));
  };
  add(filter.camera, "runs.camera = :camera");
  add(filter.station, "runs.station = :station");
  add(filter.verdict, "runs.verdict = :verdict");
  add(filter.kind, "runs.kind = :kind");
  add(filter.operator_name, "runs.operator_name = :operator_name");
  add(filter.shift, "runs.shift = :shift");
  add(filter.since, "runs.ended_utc >= :since");
  add(filter.until, "runs.ended_utc < :until");
  add(filter.destination, "runs.destination = :destination");
  add(filter.image_sha256,
      "runs.run IN (SELECT images.run FROM images WHERE images.sha256 = :sha256)");
  return filter.has_open_hook ? text + " AND " + kHookOpen : text;
}

/// Returns the rows of a query, with its columns in the members of `Row`. The query is `select`,
/// the conditions of the filter, and `end`, to which a non-empty `metric` is bound.
template <typename Row>
std::vector<Row> query_rows(soci::session& sql, const std::string& select, const RunFilter& filter,
                            const std::string& end, const std::string& metric,
                            std::initializer_list<std::string Row::*> texts,
                            double Row::*value = nullptr) {
  Row row;
  std::vector<Row> rows;
  soci::statement statement(sql);
  for (std::string Row::*text : texts) statement.exchange(soci::into(row.*text));
  if (value != nullptr) statement.exchange(soci::into(row.*value));
  const std::string conditions = bind_filter(statement, filter);
  if (!metric.empty()) statement.exchange(soci::use(metric));
  statement.alloc();
  statement.prepare(select + conditions + end);
  statement.define_and_bind();
  statement.execute();
  while (statement.fetch()) rows.push_back(row);
  return keep_last_rows(std::move(rows), filter.last);
}

}  // namespace

std::vector<double> extract_trend_values(std::span<const TrendPoint> points) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const TrendPoint& point : points) values.push_back(point.value);
  return values;
}

Records::Records(const std::string& where) : database_(std::make_unique<Database>()) {
  database_->where = where;
  database_->name = describe_database(where);
  database_->timeout_s = get_timeout_s(where);
  soci::session& sql = database_->sql;
  database_->with_database_name([&] { open_database_session(sql, where); });
  const bool are_there = database_->run([&](ConnectionWatchdog& watch) {
    configure_connection(sql, database_->timeout_s);
    watch.on_progress();
    return has_record_tables(sql);
  });
  if (!are_there) {
    database_->run([&](ConnectionWatchdog&) { create_record_tables(sql); });
  }
  database_->ready = true;
}

Records::~Records() = default;

void Records::store_run(const RunRecord& record, const std::string& destination) {
  database_->run([&](ConnectionWatchdog& watch) {
    soci::session& sql = database_->sql;
    const RunRecord escaped = escape_run(record);
    const RunRows rows = make_run_rows(serialize_run(escaped));
    soci::transaction transaction(sql);
    // Writes first, so that the transaction waits for others before it reads.
    const bool is_new = insert_run(sql, escaped.run, rows, destination, watch);
    if (!is_new && !has_stored_document(sql, escaped.run, rows.document)) {
      // [STATION-15] `has another run` | records or results edited, or two of one name | compare
      //   both
      throw InputError(database_->name, "has another run " + escaped.run);
    }
    const auto new_events = insert_events(sql, escaped, watch);
    // Last, because all stations that share the records wait for it.
    append_to_trail(sql, escaped.run, is_new ? rows.document : "", new_events);
    transaction.commit();
  });
}

void Records::remove_delivered(const RunRecord& record) {
  database_->run([&](ConnectionWatchdog&) {
    soci::session& sql = database_->sql;
    soci::transaction transaction(sql);
    sql << "DELETE FROM trail WHERE run = :run", soci::use(record.run);  // locks before it reads
    if (load_run_events(sql, record.run).size() > record.events.size()) return;
    for (const char* table : {"metrics", "images", "events", "runs"}) {
      sql << fmt::format("DELETE FROM {} WHERE run = :run", table), soci::use(record.run);
    }
    transaction.commit();
  });
}

void Records::check_writable() {
  database_->run([&](ConnectionWatchdog&) {
    soci::transaction transaction(database_->sql);
    lock_audit_trail(database_->sql);
    transaction.rollback();
  });
}

std::vector<RunSummary> Records::list_run_summaries(const RunFilter& filter) {
  using Line = RunSummary;
  constexpr const char* select =
      "SELECT run, kind, station, camera, ended_utc, verdict, causes, COALESCE((SELECT "
      "MIN(events.text) FROM events WHERE events.run = runs.run AND events.what = 'voided'), ''), "
      "destination FROM runs ";
  return database_->run(
      [&](ConnectionWatchdog&) {
        return query_rows<Line>(
            database_->sql, select, filter, " ORDER BY ended_utc, run", "",
            {&Line::run, &Line::kind, &Line::station, &Line::camera, &Line::ended_utc,
             &Line::verdict, &Line::causes, &Line::voided, &Line::destination});
      },
      filter.image_sha256.empty() ? kManyRowsTimeoutFactor : 1);
}

std::vector<TrendPoint> Records::load_metric_trend(const std::string& metric,
                                                   const RunFilter& filter) {
  using Point = TrendPoint;
  constexpr const char* select =
      "SELECT runs.run, runs.station, runs.camera, runs.verdict, runs.ended_utc, metrics.value "
      "FROM runs JOIN metrics ON metrics.run = runs.run ";
  const std::string end = " AND " + kNotVoided +
                          " AND metrics.name = :metric AND metrics.value IS NOT NULL "
                          "ORDER BY runs.ended_utc, runs.run";
  return database_->run(
      [&](ConnectionWatchdog&) {
        return query_rows<Point>(
            database_->sql, select, filter, end, metric,
            {&Point::run, &Point::station, &Point::camera, &Point::verdict, &Point::ended_utc},
            &Point::value);
      },
      kManyRowsTimeoutFactor);
}

std::optional<RunRecord> Records::find_run_by_id(const std::string& run) {
  return database_->run([&](ConnectionWatchdog&) { return load_run(database_->sql, run); });
}

TrailCheck Records::check_trail(const std::string& expected_digest) {
  return database_->run(
      [&](ConnectionWatchdog& watch) {
        soci::session& sql = database_->sql;
        soci::transaction transaction(sql);
        // Consistent snapshot despite concurrent writers; transactions of SQLite always have one.
        if (sql.get_backend_name() == "postgresql") {
          sql << "SET TRANSACTION ISOLATION LEVEL REPEATABLE READ";
        }
        TrailCheck found = check_audit_trail(sql, expected_digest, [&] { watch.on_progress(); });
        transaction.rollback();
        return found;
      },
      kManyRowsTimeoutFactor);
}

}  // namespace vlp
