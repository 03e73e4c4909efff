// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/records.h"

#include <fcntl.h>
#include <soci/postgresql/soci-postgresql.h>
#include <soci/sqlite3/soci-sqlite3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "rig/input_error.h"
#include "rig/renamed.h"
#include "station/database_name.h"
#include "station/records/record_tables.h"
#include "station/records/run_storage.h"

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
}

void open(soci::session& sql, const std::string& where) {
  if (is_server_address(where)) {
    sql.open(soci::postgresql, make_connection_string(where));
  } else {
    if (where.find('"') != std::string::npos) {
      throw InputError(where, "the name of a database cannot have a quote (\"): rename its folder");
    }
    sql.open(soci::sqlite3, "dbname=\"" + where + "\" timeout=" + std::to_string(timeout_s(where)));
  }
}

/// Returns true if a later attempt can succeed: another program holds a lock, or the file cannot be
/// opened or read.
bool is_transient(const soci::soci_error& error) {
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

/// Closes a connection without progress for timeout_s(). libpq waits forever for a frozen server,
/// which does not apply its own limits either.
class ConnectionWatchdog {
 public:
  ConnectionWatchdog(soci::session& sql, int timeout_s) : timeout_(timeout_s) {
    if (timeout_s <= 0 || sql.get_backend_name() != "postgresql") return;
    const auto* server = static_cast<soci::postgresql_session_backend*>(sql.get_backend());
    // Own descriptor: libpq closes its socket when the connection is lost, and its number can be
    // reused.
    socket_ = ::fcntl(PQsocket(server->conn_), F_DUPFD_CLOEXEC, 0);
    if (socket_ >= 0) thread_ = std::thread([this] { wait(); });
  }
  ~ConnectionWatchdog() {
    if (socket_ < 0) return;
    {
      const std::lock_guard lock(mutex_);
      is_finished_ = true;
    }
    changed_.notify_one();
    thread_.join();
    ::close(socket_);
  }
  ConnectionWatchdog(const ConnectionWatchdog&) = delete;
  ConnectionWatchdog& operator=(const ConnectionWatchdog&) = delete;

  /// Restarts the time limit.
  void on_progress() {
    const std::lock_guard lock(mutex_);
    last_ = Clock::now();
  }
  bool has_timed_out() {
    const std::lock_guard lock(mutex_);
    return has_timed_out_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  void wait() {
    std::unique_lock lock(mutex_);
    while (!is_finished_) {
      const auto until = last_ + timeout_;
      if (Clock::now() >= until) {
        has_timed_out_ = true;
        ::shutdown(socket_, SHUT_RDWR);
        return;
      }
      changed_.wait_until(lock, until);
    }
  }

  std::chrono::seconds timeout_;
  Clock::time_point last_ = Clock::now();
  bool is_finished_ = false, has_timed_out_ = false;
  int socket_ = -1;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_;
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
    if (!refused)
      throw RecordsOffline(name, "the server of the records cannot be reached: " + what);
    throw RecordsRefused(
        name, "the server of the records answers, but refuses 'records' as it is: " + what);
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
      if (is_transient(error)) throw RecordsOffline(name, "the records: " + what);
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
        return run_watched(action, timeout_factor);
      } catch (const soci::soci_error&) {
        if (!ready || sql.is_connected()) throw;
      }
      // A unit takes minutes, in which the server can restart or the network can fail.
      sql.reconnect();
      return run_watched(
          [&](ConnectionWatchdog& watch) {
            configure_connection(sql, timeout_s);
            watch.on_progress();
            return action(watch);
          },
          timeout_factor);
    });
  }

 private:
  template <typename Action>
  auto run_watched(const Action& action, int timeout_factor) {
    ConnectionWatchdog watch(sql, timeout_factor * timeout_s);
    try {
      return action(watch);
    } catch (const soci::soci_error&) {
      if (!watch.has_timed_out()) throw;
      throw RecordsOffline(name, "the server of the records has not answered for " +
                                     std::to_string(timeout_factor * timeout_s) + " s");
    }
  }
};

namespace {

/// Factor of the time limit for many rows: the server collects them before it sends the first one.
constexpr int kManyRowsTimeoutFactor = 10;
/// Factor of the time limit for tables: an hour by default, for an index of all images.
constexpr int kMigrationTimeoutFactor = 360;

bool same_texts(const RunRecord& a, const RunRecord& b) {
  const auto fields = run_fields();
  return std::all_of(fields.begin(), fields.end(),
                     [&](const RunField& field) { return a.*field.text == b.*field.text; });
}

void insert_metrics(soci::session& sql, const RunRecord& record, ConnectionWatchdog& watch) {
  int place = 0;
  for (const CheckedMetric& metric : record.metrics) {
    const double value = metric.value.value_or(0), gate = metric.limit.value_or(0);
    soci::indicator has_value = metric.value ? soci::i_ok : soci::i_null;
    soci::indicator has_gate = metric.limit ? soci::i_ok : soci::i_null;
    const auto [uncertainty, guard_k] = metric.guard.value_or(GuardBand{});
    soci::indicator has_guard = metric.guard ? soci::i_ok : soci::i_null;
    const int at_least = metric.direction == Direction::at_least ? 1 : 0,
              passed = metric.passed() ? 1 : 0;
    ++place;
    sql << "INSERT INTO figures (run, place, name, value, gate, at_least, met, unit, uncertainty, "
           "guard_k) VALUES (:run, :place, :name, :value, :gate, :at_least, :met, :unit, "
           ":uncertainty, :guard_k)",
        soci::use(record.run), soci::use(place), soci::use(metric.name),
        soci::use(value, has_value), soci::use(gate, has_gate), soci::use(at_least),
        soci::use(passed), soci::use(metric.unit), soci::use(uncertainty, has_guard),
        soci::use(guard_k, has_guard);
    watch.on_progress();
  }
}

void insert_images(soci::session& sql, const RunRecord& record, ConnectionWatchdog& watch) {
  for (const auto& [step, name, sha256, refused] : record.images) {
    sql << "INSERT INTO images (run, step, image, sha256, refused) VALUES (:run, :step, :image, "
           ":sha256, :refused)",
        soci::use(record.run), soci::use(step), soci::use(name), soci::use(sha256),
        soci::use(refused);
    watch.on_progress();
  }
}

/// Stores the new events. Returns their contents for the trail.
std::vector<TrailContent> insert_events(soci::session& sql, const RunRecord& record,
                                        ConnectionWatchdog& watch) {
  std::vector<TrailContent> added;
  for (const RunEvent& event : record.events) {
    soci::statement insert =
        (sql.prepare << "INSERT INTO events (event, run, what, text, who) VALUES (:event, :run, "
                        ":what, :text, :who) ON CONFLICT (event) DO NOTHING",
         soci::use(event.event), soci::use(record.run), soci::use(event.what),
         soci::use(event.text), soci::use(event.who));
    insert.execute(true);
    if (insert.get_affected_rows() > 0) added.push_back(make_event_content(record.run, event));
    watch.on_progress();
  }
  return added;
}

/// Condition for a run in a query.
const std::string kNotVoided =
    "NOT EXISTS (SELECT 1 FROM events WHERE events.run = runs.run AND events.what = 'voided')";

std::string make_condition(const RunFilter& filter) {
  std::string text = "WHERE 1 = 1";
  if (!filter.camera.empty()) text += " AND runs.camera = :camera";
  if (!filter.station.empty()) text += " AND runs.station = :station";
  if (!filter.verdict.empty()) text += " AND runs.verdict = :verdict";
  if (!filter.kind.empty()) text += " AND runs.kind = :kind";
  if (!filter.operator_name.empty()) text += " AND runs.operator_name = :operator_name";
  if (!filter.shift.empty()) text += " AND runs.shift = :shift";
  if (!filter.since.empty()) text += " AND runs.ended_utc >= :since";
  if (!filter.until.empty()) text += " AND runs.ended_utc < :until";
  return text;
}

void bind_filter(soci::statement& statement, const RunFilter& filter) {
  for (const std::string* value :
       {&filter.camera, &filter.station, &filter.verdict, &filter.kind, &filter.operator_name,
        &filter.shift, &filter.since, &filter.until}) {
    if (!value->empty()) statement.exchange(soci::use(*value));
  }
}

/// Returns the rows of a query, with its columns in the members of `Row`; a non-empty `figure` and
/// its former name are bound after the filter.
template <typename Row>
std::vector<Row> query_rows(soci::session& sql, const std::string& query, const RunFilter& filter,
                            const std::string& metric,
                            std::initializer_list<std::string Row::*> texts,
                            double Row::*value = nullptr) {
  Row row;
  std::vector<Row> rows;
  soci::statement statement(sql);
  for (std::string Row::*text : texts) statement.exchange(soci::into(row.*text));
  if (value != nullptr) statement.exchange(soci::into(row.*value));
  bind_filter(statement, filter);
  const std::string former(find_former_name(NameKind::metric, metric));
  if (!metric.empty()) {
    statement.exchange(soci::use(metric));
    statement.exchange(soci::use(former));
  }
  statement.alloc();
  statement.prepare(query);
  statement.define_and_bind();
  statement.execute();
  while (statement.fetch()) rows.push_back(row);
  return keep_last(std::move(rows), filter.last);
}

}  // namespace

std::string utc_problem(const std::string& text) {
  const std::string form = "0000-00-00T00:00:00Z";
  constexpr std::array<std::size_t, 4> lengths{10, 16, 19, 20};
  bool is_valid = std::find(lengths.begin(), lengths.end(), text.size()) != lengths.end();
  for (std::size_t i = 0; is_valid && i < text.size(); ++i) {
    is_valid = form[i] == '0' ? text[i] >= '0' && text[i] <= '9' : text[i] == form[i];
  }
  if (is_valid) {
    const auto at = [&](std::size_t begin) {
      return static_cast<unsigned>(std::stoul(text.substr(begin, 2)));
    };
    constexpr std::size_t month = 5, day = 8, hour = 11, minute = 14, second = 17;
    const std::chrono::year year(std::stoi(text.substr(0, 4)));
    const auto below = [&](std::size_t begin, unsigned end) {
      return text.size() < begin + 2 || at(begin) < end;
    };
    is_valid = (year / std::chrono::month(at(month)) / std::chrono::day(at(day))).ok() &&
               below(hour, 24) && below(minute, 60) && below(second, 60);
  }
  return is_valid ? "" : "should be a UTC as 2026-11-21 or 2026-11-21T13:45, not " + text;
}

std::vector<double> extract_values(std::span<const TrendPoint> points) {
  std::vector<double> values;
  values.reserve(points.size());
  for (const TrendPoint& point : points) values.push_back(point.value);
  return values;
}

Records::Records(const std::string& where) : database_(std::make_unique<Database>()) {
  database_->where = where;
  database_->name = describe_database(where);
  database_->timeout_s = timeout_s(where);
  database_->with_database_name([&] { open(database_->sql, where); });
  const bool are_there = database_->run([&](ConnectionWatchdog& watch) {
    configure_connection(database_->sql, database_->timeout_s);
    watch.on_progress();
    return has_current_tables(database_->sql);
  });
  if (!are_there)
    database_->run([&](ConnectionWatchdog&) { make_record_tables(database_->sql); },
                   kMigrationTimeoutFactor);
  database_->ready = true;
}

Records::~Records() = default;

void Records::keep(const RunRecord& record) {
  database_->run([&](ConnectionWatchdog& watch) {
    soci::session& sql = database_->sql;
    soci::transaction transaction(sql);
    // Writes first, so that the transaction waits for others before it reads.
    soci::statement insert(sql);
    std::string columns, places;
    for (const auto& [name, text, label, in_csv] : run_fields()) {
      columns.append(columns.empty() ? "" : ", ").append(name);
      places.append(places.empty() ? ":" : ", :").append(name);
      insert.exchange(soci::use(record.*text, name));
    }
    insert.alloc();
    insert.prepare("INSERT INTO runs (" + columns + ") VALUES (" + places +
                   ") ON CONFLICT (run) DO NOTHING");
    insert.define_and_bind();
    insert.execute(true);
    watch.on_progress();
    std::vector<TrailContent> added;
    if (insert.get_affected_rows() > 0) {
      insert_metrics(sql, record, watch);
      insert_images(sql, record, watch);
      added.push_back(make_run_digest_entry(sql, record.run));
    } else if (const auto kept = load_run_header(sql, record.run);
               !kept || !same_texts(*kept, record)) {
      throw InputError(database_->name, "has another run " + record.run);
    }
    for (TrailContent& event : insert_events(sql, record, watch)) added.push_back(std::move(event));
    // Last, because all stations that share the records wait for it.
    append_to_trail(sql, added);
    transaction.commit();
  });
}

void Records::check_writable() {
  database_->run([&](ConnectionWatchdog&) {
    soci::transaction transaction(database_->sql);
    lock_trail(database_->sql);
    transaction.rollback();
  });
}

ImageOwner Records::find_owner(const std::string& sha256, const std::string& other_than_camera) {
  return database_->run([&](ConnectionWatchdog&) {
    std::string camera, run;
    database_->sql << "SELECT runs.camera, runs.run FROM images JOIN runs ON runs.run = images.run "
                      "WHERE images.sha256 = :sha256 AND images.refused = '' AND runs.camera <> "
                      ":camera AND " +
                          kNotVoided + " ORDER BY runs.run LIMIT 1",
        soci::into(camera), soci::into(run), soci::use(sha256), soci::use(other_than_camera);
    return ImageOwner{camera, run};
  });
}

std::vector<std::string> Records::find_judged_runs(const std::string& sha256,
                                                   const std::string& camera) {
  return database_->run(
      [&](ConnectionWatchdog&) {
        std::string run;
        std::vector<std::string> runs;
        const std::string invalid = to_string(Verdict::invalid);
        soci::statement judged =
            (database_->sql.prepare
                 << "SELECT DISTINCT runs.run FROM images JOIN runs ON runs.run = images.run WHERE "
                    "images.sha256 = :sha256 AND images.refused = '' AND runs.kind = 'unit' AND "
                    "runs.camera = :camera AND runs.verdict <> :invalid AND " +
                        kNotVoided + " ORDER BY runs.run",
             soci::into(run), soci::use(sha256), soci::use(camera), soci::use(invalid));
        judged.execute();
        while (judged.fetch()) runs.push_back(run);
        return runs;
      });
}

std::string Records::find_golden_run(const std::string& sha256) {
  return database_->run([&](ConnectionWatchdog&) {
    std::string run;
    const std::string invalid = to_string(Verdict::invalid);
    database_->sql << "SELECT runs.run FROM images JOIN runs ON runs.run = images.run WHERE "
                      "images.sha256 = :sha256 AND images.refused = '' AND runs.kind = 'golden' "
                      "AND runs.verdict <> :invalid ORDER BY runs.run LIMIT 1",
        soci::into(run), soci::use(sha256), soci::use(invalid);
    return run;
  });
}

std::vector<std::string> Records::find_open_hooks(const std::string& station) {
  return database_->run(
      [&](ConnectionWatchdog&) {
        std::string run;
        std::vector<std::string> runs;
        const std::string wanted = kHookRequested, done = kHookDone;
        soci::statement open =
            (database_->sql.prepare
                 << "SELECT DISTINCT events.run FROM events JOIN runs ON runs.run = events.run "
                    "WHERE events.what = :wanted AND (:station = '' OR runs.station = :of) AND NOT "
                    "EXISTS (SELECT 1 FROM events ended WHERE ended.run = events.run AND "
                    "ended.what = :done AND ended.event > events.event) ORDER BY events.run",
             soci::into(run), soci::use(wanted), soci::use(station), soci::use(station),
             soci::use(done));
        open.execute();
        while (open.fetch()) runs.push_back(run);
        return runs;
      },
      kManyRowsTimeoutFactor);
}

std::vector<RunSummary> Records::list(const RunFilter& filter) {
  using Line = RunSummary;
  const std::string query =
      "SELECT run, kind, station, camera, ended_utc, verdict, causes, COALESCE((SELECT "
      "MIN(events.text) FROM events WHERE events.run = runs.run AND events.what = 'voided'), '') "
      "FROM runs " +
      make_condition(filter) + " ORDER BY ended_utc, run";
  return database_->run(
      [&](ConnectionWatchdog&) {
        return query_rows<Line>(database_->sql, query, filter, "",
                                {&Line::run, &Line::kind, &Line::station, &Line::camera,
                                 &Line::ended_utc, &Line::verdict, &Line::causes, &Line::voided});
      },
      kManyRowsTimeoutFactor);
}

std::vector<TrendPoint> Records::trend(const std::string& metric, const RunFilter& filter) {
  using Point = TrendPoint;
  const std::string query =
      "SELECT runs.run, runs.station, runs.camera, runs.verdict, runs.ended_utc, figures.value "
      "FROM runs JOIN figures ON figures.run = runs.run " +
      make_condition(filter) + " AND " + kNotVoided +
      " AND figures.name IN (:figure, :former) AND figures.value IS NOT NULL "
      "ORDER BY runs.ended_utc, runs.run";
  return database_->run(
      [&](ConnectionWatchdog&) {
        return query_rows<Point>(
            database_->sql, query, filter, metric,
            {&Point::run, &Point::station, &Point::camera, &Point::verdict, &Point::ended_utc},
            &Point::value);
      },
      kManyRowsTimeoutFactor);
}

std::optional<RunRecord> Records::find(const std::string& run) {
  auto found = database_->run([&](ConnectionWatchdog&) { return load_run(database_->sql, run); });
  if (!found) return found;
  for (CheckedMetric& metric : found->metrics) metric.name = present_metric_name(metric.name);
  return found;
}

TrailCheck Records::check(const std::string& expected_digest) {
  return database_->run(
      [&](ConnectionWatchdog& watch) {
        soci::session& sql = database_->sql;
        soci::transaction transaction(sql);
        // Consistent snapshot despite concurrent writers; transactions of SQLite always have one.
        if (sql.get_backend_name() == "postgresql") {
          sql << "SET TRANSACTION ISOLATION LEVEL REPEATABLE READ";
        }
        TrailCheck found = check_trail(sql, expected_digest, [&] { watch.on_progress(); });
        transaction.rollback();
        return found;
      },
      kManyRowsTimeoutFactor);
}

}  // namespace vlp
