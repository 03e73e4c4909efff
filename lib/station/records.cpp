// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records.h"

#include <soci/postgresql/soci-postgresql.h>
#include <soci/sqlite3/soci-sqlite3.h>

#include <chrono>
#include <thread>

#include "station/record_tables.h"
#include "station/records_database.h"

namespace vlp {
namespace {

/// In seconds. Others that write a run need some milliseconds each.
constexpr int kPatience_s = 30;

void open(soci::session& sql, const std::string& where) {
  if (where.starts_with("postgresql://")) {
    sql.open(soci::postgresql, where);
    sql << "SET client_min_messages TO warning";
    return;
  }
  sql.open(soci::sqlite3, "dbname=\"" + where + "\" timeout=" + std::to_string(kPatience_s));
  // What is committed is on the disk; a second connection sees runs whole.
  sql << "PRAGMA synchronous = FULL";
  sql << "PRAGMA foreign_keys = ON";
}

void put_figures(soci::session& sql, const RunRecord& record) {
  int place = 0;
  for (const StationFigure& figure : record.figures) {
    const double value = figure.value.value_or(0), gate = figure.limit.value_or(0);
    soci::indicator has_value = figure.value ? soci::i_ok : soci::i_null;
    soci::indicator has_gate = figure.limit ? soci::i_ok : soci::i_null;
    const int at_least = figure.at_least ? 1 : 0, met = figure.met() ? 1 : 0;
    ++place;
    sql << "INSERT INTO figures (run, place, name, value, gate, at_least, met) VALUES (:run, "
           ":place, :name, :value, :gate, :at_least, :met)",
        soci::use(record.run), soci::use(place), soci::use(figure.name),
        soci::use(value, has_value), soci::use(gate, has_gate), soci::use(at_least), soci::use(met);
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

}  // namespace

Records::Records(const std::string& where) : database_(std::make_unique<Database>()) {
  database_->where = where;
  database_->run([&] {
    open(database_->sql, where);
    // Two that make the tables at once get in each other's way once.
    constexpr int tries = 8;
    for (int i = 1;; ++i) {
      try {
        return make_record_tables(database_->sql);
      } catch (const soci::soci_error&) {
        if (i == tries) throw;
        std::this_thread::sleep_for(std::chrono::milliseconds(20 * i));
      }
    }
  });
  database_->ready = true;
}

Records::~Records() = default;

void Records::keep(const RunRecord& record) {
  database_->run([&] {
    soci::session& sql = database_->sql;
    const std::string begun = begun_utc(record.run);
    soci::transaction transaction(sql);
    // Writes first, so that it waits for others before it has read anything.
    soci::statement insert =
        (sql.prepare << "INSERT INTO runs (run, kind, station, camera, begun_utc, ended_utc, "
                        "verdict, causes, program, libraries, config_sha256, calibration) "
                        "VALUES (:run, :kind, :station, :camera, :begun, :ended, :verdict, "
                        ":causes, :program, :libraries, :config, :calibration) "
                        "ON CONFLICT (run) DO NOTHING",
         soci::use(record.run), soci::use(record.kind), soci::use(record.station),
         soci::use(record.camera), soci::use(begun), soci::use(record.ended_utc),
         soci::use(record.verdict), soci::use(record.causes), soci::use(record.program),
         soci::use(record.libraries), soci::use(record.config_sha256),
         soci::use(record.calibration));
    insert.execute(true);
    if (insert.get_affected_rows() > 0) {
      put_figures(sql, record);
      put_images(sql, record);
    }
    transaction.commit();
  });
}

bool Records::has(const std::string& run) {
  return database_->run([&] {
    int count = 0;
    database_->sql << "SELECT COUNT(*) FROM runs WHERE run = :run", soci::into(count),
        soci::use(run);
    return count > 0;
  });
}

}  // namespace vlp
