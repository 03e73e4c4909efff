// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records.h"

#include <soci/postgresql/soci-postgresql.h>
#include <soci/sqlite3/soci-sqlite3.h>

#include <algorithm>
#include <memory>
#include <string>

#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/record_tables.h"

namespace vlp {
namespace {

/// In seconds. Others that write a run need some milliseconds each.
constexpr int kPatience_s = 30;

/// What a connection has to be told each time that it is made.
void set_up(soci::session& sql) {
  if (sql.get_backend_name() == "postgresql") {
    sql << "SET client_min_messages TO warning";
    sql << "SET lock_timeout TO '" + std::to_string(kPatience_s) + "s'";
    return;
  }
  // What is committed is on the disk; a second connection sees runs whole.
  sql << "PRAGMA synchronous = FULL";
  sql << "PRAGMA foreign_keys = ON";
}

void open(soci::session& sql, const std::string& where) {
  if (is_server(where)) {
    sql.open(soci::postgresql, connection_of(where));
  } else {
    sql.open(soci::sqlite3, "dbname=\"" + where + "\" timeout=" + std::to_string(kPatience_s));
  }
  set_up(sql);
}

}  // namespace

struct Records::Database {
  /// For messages.
  std::string name;
  soci::session sql;

  /// Tables are there; from then on a connection that was lost is made again.
  bool ready = false;

  /// Errors name the database. The action may be done twice.
  template <typename Action>
  auto run(const Action& action) {
    try {
      try {
        return action();
      } catch (const soci::soci_error&) {
        if (!ready || sql.is_connected()) throw;
      }
      // A unit takes its minutes: meanwhile the server was started anew, or the network fell
      // asleep.
      sql.reconnect();
      set_up(sql);
      return action();
    } catch (const InputError&) {
      throw;
    } catch (const soci::soci_error& error) {
      std::string what = error.what();
      std::replace_if(
          what.begin(), what.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
      const bool away = name.starts_with("postgresql://") && !sql.is_connected();
      throw InputError(name,
                       away ? "the server of the records cannot be reached; when it answers, the "
                              "same command goes on: " +
                                  what
                            : "the records: " + what);
    } catch (const std::exception& error) {
      throw InputError(name, error.what());
    }
  }
};

namespace {

void put_figures(soci::session& sql, const RunRecord& record) {
  int place = 0;
  for (const CheckedMetric& figure : record.figures) {
    const double value = figure.value.value_or(0), gate = figure.limit.value_or(0);
    soci::indicator has_value = figure.value ? soci::i_ok : soci::i_null;
    soci::indicator has_gate = figure.limit ? soci::i_ok : soci::i_null;
    const int at_least = figure.asked == Direction::at_least ? 1 : 0, met = figure.met() ? 1 : 0;
    ++place;
    sql << "INSERT INTO figures (run, place, name, value, gate, at_least, met, unit) VALUES "
           "(:run, :place, :name, :value, :gate, :at_least, :met, :unit)",
        soci::use(record.run), soci::use(place), soci::use(figure.name),
        soci::use(value, has_value), soci::use(gate, has_gate), soci::use(at_least), soci::use(met),
        soci::use(figure.unit);
  }
}

void put_images(soci::session& sql, const RunRecord& record) {
  for (const auto& [step, name, sha256, refused] : record.images) {
    sql << "INSERT INTO images (run, step, image, sha256, refused) VALUES (:run, :step, :image, "
           ":sha256, :refused)",
        soci::use(record.run), soci::use(step), soci::use(name), soci::use(sha256),
        soci::use(refused);
  }
}

std::string condition(const RunFilter& filter) {
  std::string text = "WHERE 1 = 1";
  if (!filter.camera.empty()) text += " AND runs.camera = :camera";
  if (!filter.station.empty()) text += " AND runs.station = :station";
  if (!filter.verdict.empty()) text += " AND runs.verdict = :verdict";
  if (!filter.kind.empty()) text += " AND runs.kind = :kind";
  return text;
}

void bind(soci::statement& statement, const RunFilter& filter) {
  for (const std::string* value :
       {&filter.camera, &filter.station, &filter.verdict, &filter.kind}) {
    if (!value->empty()) statement.exchange(soci::use(*value));
  }
}

template <typename Row>
std::vector<Row> last_of(std::vector<Row> rows, int last) {
  const auto kept = static_cast<std::size_t>(last);
  if (last > 0 && rows.size() > kept) {
    rows.erase(rows.begin(), rows.end() - static_cast<std::ptrdiff_t>(kept));
  }
  return rows;
}

}  // namespace

Records::Records(const std::string& where) : database_(std::make_unique<Database>()) {
  database_->name = name_of_database(where);
  database_->run([&] {
    open(database_->sql, where);
    make_record_tables(database_->sql);
  });
  database_->ready = true;
}

Records::~Records() = default;

void Records::keep(const RunRecord& record) {
  database_->run([&] {
    soci::session& sql = database_->sql;
    soci::transaction transaction(sql);
    // Writes first, so that it waits for others before it has read anything.
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
    if (insert.get_affected_rows() > 0) {
      put_figures(sql, record);
      put_images(sql, record);
    }
    transaction.commit();
  });
}

void Records::check_writable() {
  database_->run([&] {
    soci::transaction transaction(database_->sql);
    database_->sql << "UPDATE vlp_schema SET version = version";
    transaction.rollback();
  });
}

std::string Records::owner_of(const std::string& sha256, const std::string& other_than_camera) {
  return database_->run([&] {
    std::string camera, run;
    database_->sql << "SELECT runs.camera, runs.run FROM images JOIN runs ON runs.run = images.run "
                      "WHERE images.sha256 = :sha256 AND images.refused = '' AND runs.camera <> "
                      ":camera ORDER BY runs.run LIMIT 1",
        soci::into(camera), soci::into(run), soci::use(sha256), soci::use(other_than_camera);
    return run.empty() ? std::string() : "camera " + camera + ": run " + run;
  });
}

std::vector<RunSummary> Records::list(const RunFilter& filter) {
  return database_->run([&] {
    RunSummary row;
    std::vector<RunSummary> rows;
    soci::statement statement(database_->sql);
    statement.exchange(soci::into(row.run));
    statement.exchange(soci::into(row.kind));
    statement.exchange(soci::into(row.station));
    statement.exchange(soci::into(row.camera));
    statement.exchange(soci::into(row.ended_utc));
    statement.exchange(soci::into(row.verdict));
    statement.exchange(soci::into(row.causes));
    bind(statement, filter);
    statement.alloc();
    statement.prepare("SELECT run, kind, station, camera, ended_utc, verdict, causes FROM runs " +
                      condition(filter) + " ORDER BY ended_utc, run");
    statement.define_and_bind();
    statement.execute();
    while (statement.fetch()) rows.push_back(row);
    return last_of(std::move(rows), filter.last);
  });
}

std::vector<TrendPoint> Records::trend(const std::string& figure, const RunFilter& filter) {
  return database_->run([&] {
    TrendPoint row;
    std::vector<TrendPoint> rows;
    soci::statement statement(database_->sql);
    statement.exchange(soci::into(row.run));
    statement.exchange(soci::into(row.station));
    statement.exchange(soci::into(row.camera));
    statement.exchange(soci::into(row.verdict));
    statement.exchange(soci::into(row.value));
    bind(statement, filter);
    statement.exchange(soci::use(figure));
    statement.alloc();
    statement.prepare(
        "SELECT runs.run, runs.station, runs.camera, runs.verdict, figures.value FROM runs JOIN "
        "figures ON "
        "figures.run = runs.run " +
        condition(filter) +
        " AND figures.name = :figure AND figures.value IS NOT NULL ORDER BY runs.ended_utc, "
        "runs.run");
    statement.define_and_bind();
    statement.execute();
    while (statement.fetch()) rows.push_back(row);
    return last_of(std::move(rows), filter.last);
  });
}

std::optional<RunRecord> Records::find(const std::string& run) {
  return database_->run([&]() -> std::optional<RunRecord> {
    soci::session& sql = database_->sql;
    RunRecord record;
    soci::statement select(sql);
    std::string columns;
    for (const auto& [name, text, label, in_csv] : run_fields()) {
      columns.append(columns.empty() ? "" : ", ").append(name);
      select.exchange(soci::into(record.*text));
    }
    select.exchange(soci::use(run, "key"));
    select.alloc();
    select.prepare("SELECT " + columns + " FROM runs WHERE run = :key");
    select.define_and_bind();
    if (!select.execute(true)) return std::nullopt;
    CheckedMetric figure;
    double value = 0, gate = 0;
    int at_least = 0;
    soci::indicator has_value = soci::i_null, has_gate = soci::i_null;
    soci::statement figures =
        (sql.prepare
             << "SELECT name, value, gate, at_least, unit FROM figures WHERE run = :run ORDER "
                "BY place",
         soci::into(figure.name), soci::into(value, has_value), soci::into(gate, has_gate),
         soci::into(at_least), soci::into(figure.unit), soci::use(run));
    figures.execute();
    while (figures.fetch()) {
      figure.value = has_value == soci::i_ok ? std::optional(value) : std::nullopt;
      figure.limit = has_gate == soci::i_ok ? std::optional(gate) : std::nullopt;
      figure.asked = at_least != 0 ? Direction::at_least : Direction::at_most;
      record.figures.push_back(figure);
    }
    RunRecord::Image image;
    soci::statement images =
        (sql.prepare << "SELECT step, image, sha256, refused FROM images WHERE run = :run ORDER "
                        "BY step, image",
         soci::into(image.step), soci::into(image.name), soci::into(image.sha256),
         soci::into(image.refused), soci::use(run));
    images.execute();
    while (images.fetch()) record.images.push_back(image);
    return record;
  });
}

}  // namespace vlp
