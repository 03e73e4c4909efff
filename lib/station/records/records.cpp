// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/records.h"

#include <fmt/core.h>

#include <initializer_list>
#include <memory>
#include <string>
#include <utility>

#include "rig/input_error.h"
#include "station/records/record_database.h"
#include "station/records/record_tables.h"

namespace vlp {
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

Records::Records(const std::string& where) : database_(std::make_unique<RecordDatabase>(where)) {}

Records::~Records() = default;

void Records::store_run(const RunRecord& record, const std::string& destination) {
  database_->run([&](ConnectionWatchdog& watch) {
    soci::session& sql = database_->session();
    const RunRecord escaped = escape_run(record);
    const RunRows rows = make_run_rows(serialize_run(escaped));
    soci::transaction transaction(sql);
    // Writes first, so that the transaction waits for others before it reads.
    const bool is_new = insert_run(sql, escaped.run, rows, destination, watch);
    if (!is_new && !has_stored_document(sql, escaped.run, rows.document)) {
      // [STATION-15] `has another run` | records or results edited, or two of one name | compare
      //   both
      throw InputError(database_->printable_name(), "has another run " + escaped.run);
    }
    const auto new_events = insert_events(sql, escaped, watch);
    // Last, because all stations that share the records wait for it.
    append_to_trail(sql, escaped.run, is_new ? rows.document : "", new_events);
    transaction.commit();
  });
}

void Records::remove_delivered(const RunRecord& record) {
  database_->run([&](ConnectionWatchdog&) {
    soci::session& sql = database_->session();
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
    soci::transaction transaction(database_->session());
    lock_audit_trail(database_->session());
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
            database_->session(), select, filter, " ORDER BY ended_utc, run", "",
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
            database_->session(), select, filter, end, metric,
            {&Point::run, &Point::station, &Point::camera, &Point::verdict, &Point::ended_utc},
            &Point::value);
      },
      kManyRowsTimeoutFactor);
}

std::optional<RunRecord> Records::find_run_by_id(const std::string& run) {
  return database_->run([&](ConnectionWatchdog&) { return load_run(database_->session(), run); });
}

TrailCheck Records::check_trail(const std::string& expected_digest) {
  return database_->run(
      [&](ConnectionWatchdog& watch) {
        soci::session& sql = database_->session();
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
