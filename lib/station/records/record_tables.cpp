// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/record_tables.h"

#include <stdexcept>
#include <string>
#include <vector>

#include "station/records/audit_trail.h"
#include "station/records/run_record.h"

namespace vlp {
namespace {

constexpr const char* kFigures =  // gate: NULL without a gate; guard_k: NULL without a guard band
    "CREATE TABLE IF NOT EXISTS figures (run VARCHAR(64) NOT NULL REFERENCES runs (run), "
    "place INTEGER NOT NULL, name VARCHAR(64) NOT NULL, value DOUBLE PRECISION, "
    "gate DOUBLE PRECISION, at_least INTEGER NOT NULL, met INTEGER NOT NULL, "
    "unit VARCHAR(16) NOT NULL DEFAULT '', uncertainty DOUBLE PRECISION, "
    "guard_k DOUBLE PRECISION, PRIMARY KEY (run, name))";

constexpr const char* kImages =
    "CREATE TABLE IF NOT EXISTS images (run VARCHAR(64) NOT NULL REFERENCES runs (run), "
    "step VARCHAR(16) NOT NULL, image VARCHAR(255) NOT NULL, sha256 TEXT NOT NULL, "
    "refused TEXT NOT NULL, PRIMARY KEY (run, step, image))";

constexpr const char* kImagesByDigest =
    "CREATE INDEX IF NOT EXISTS images_by_sha256 ON images (sha256)";

constexpr const char* kEvents =
    "CREATE TABLE IF NOT EXISTS events (event VARCHAR(64) PRIMARY KEY, "
    "run VARCHAR(64) NOT NULL REFERENCES runs (run), what VARCHAR(32) NOT NULL, "
    "text TEXT NOT NULL, who TEXT NOT NULL DEFAULT '')";

constexpr const char* kEventsByRun = "CREATE INDEX IF NOT EXISTS events_by_run ON events (run)";

/// Without a reference to runs, so that an entry remains when its run is removed.
constexpr const char* kTrail =
    "CREATE TABLE IF NOT EXISTS trail (number BIGINT PRIMARY KEY, run VARCHAR(64) NOT NULL, "
    "event VARCHAR(64) NOT NULL, content TEXT NOT NULL, digest TEXT NOT NULL)";

std::vector<std::string> list_table_statements() {
  std::string runs = "CREATE TABLE IF NOT EXISTS runs (run VARCHAR(64) PRIMARY KEY";
  for (const RunField& field : list_run_text_fields().subspan(1)) {
    runs.append(", ").append(field.name).append(" TEXT NOT NULL");
  }
  runs += ")";
  return {"CREATE TABLE IF NOT EXISTS vlp_schema (version INTEGER PRIMARY KEY)",
          runs,
          kFigures,
          kImages,
          kEvents,
          kEventsByRun,
          kTrail,
          "CREATE INDEX IF NOT EXISTS runs_by_camera ON runs (camera)",
          kImagesByDigest};
}

bool is_sqlite(soci::session& sql) { return sql.get_backend_name() == "sqlite3"; }

void read_run_metrics(soci::session& sql, RunRecord& record) {
  CheckedMetric metric;
  double value = 0, gate = 0;
  GuardBand guard{};
  int at_least = 0;
  soci::indicator has_value = soci::i_null, has_gate = soci::i_null, has_u = soci::i_null,
                  has_k = soci::i_null;
  soci::statement metrics =
      (sql.prepare << "SELECT name, value, gate, at_least, unit, uncertainty, guard_k FROM figures "
                      "WHERE run = :run ORDER BY place",
       soci::into(metric.name), soci::into(value, has_value), soci::into(gate, has_gate),
       soci::into(at_least), soci::into(metric.unit), soci::into(guard.standard_uncertainty, has_u),
       soci::into(guard.k, has_k), soci::use(record.run));
  metrics.execute();
  while (metrics.fetch()) {
    metric.value = has_value == soci::i_ok ? std::optional(value) : std::nullopt;
    metric.limit = has_gate == soci::i_ok ? std::optional(gate) : std::nullopt;
    metric.direction = at_least != 0 ? Direction::at_least : Direction::at_most;
    const bool guarded = has_u == soci::i_ok && has_k == soci::i_ok;
    metric.guard_band = guarded ? std::optional(guard) : std::nullopt;
    record.metrics.push_back(metric);
  }
}

}  // namespace

bool has_record_tables(soci::session& sql) {
  // Not to_regclass(): an earlier result of a connection can be cached, and be wrong after waiting
  // for the lock.
  const char* const query =
      is_sqlite(sql)
          ? "SELECT COUNT(*) FROM sqlite_master WHERE type = 'table' AND name = 'vlp_schema'"
          : "SELECT COUNT(*) FROM pg_tables WHERE tablename = 'vlp_schema' AND "
            "schemaname = ANY (current_schemas(false))";
  int tables_there = 0, version = 0;
  sql << query, soci::into(tables_there);
  if (tables_there == 0) return false;
  sql << "SELECT COALESCE(MAX(version), 0) FROM vlp_schema", soci::into(version);
  if (version == kSchemaVersion) return true;
  throw std::runtime_error("contains records of version " + std::to_string(version) +
                           ", this program reads version " + std::to_string(kSchemaVersion) +
                           ": use the vlp-station that wrote them");
}

void create_record_tables(soci::session& sql) {
  soci::transaction transaction(sql);
  // Serialized: a waiting program sees the changes of the other.
  if (is_sqlite(sql)) {
    // Write lock from the start: a reader that becomes a writer may not wait for other writers.
    sql << "COMMIT";
    sql << "BEGIN IMMEDIATE";
  } else {
    // CREATE TABLE IF NOT EXISTS alone fails, in several ways, concurrently with another of the
    // same table.
    sql << "SELECT pg_advisory_xact_lock(" + std::to_string(kTableLockId) + ")";
  }
  if (!has_record_tables(sql)) {
    for (const std::string& table : list_table_statements()) sql << table;
    sql << "INSERT INTO vlp_schema (version) SELECT CAST(:version AS INTEGER) WHERE NOT EXISTS "
           "(SELECT 1 FROM vlp_schema)",
        soci::use(kSchemaVersion);
  }
  transaction.commit();
}

std::optional<RunRecord> load_run_text_fields(soci::session& sql, const std::string& run) {
  RunRecord record;
  soci::statement select(sql);
  std::string columns;
  for (const auto& [name, text, label, in_csv] : list_run_text_fields()) {
    columns.append(columns.empty() ? "" : ", ").append(name);
    select.exchange(soci::into(record.*text));
  }
  select.exchange(soci::use(run, "key"));
  select.alloc();
  select.prepare("SELECT " + columns + " FROM runs WHERE run = :key");
  select.define_and_bind();
  if (!select.execute(true)) return std::nullopt;
  return record;
}

std::optional<RunRecord> load_run_with_all_parts(soci::session& sql, const std::string& run) {
  std::optional<RunRecord> found = load_run_text_fields(sql, run);
  if (!found) return found;
  read_run_metrics(sql, *found);
  RunRecord::Image image;
  soci::statement images =
      (sql.prepare << "SELECT step, image, sha256, refused FROM images WHERE run = :run ORDER "
                      "BY step, image",
       soci::into(image.step), soci::into(image.name), soci::into(image.sha256),
       soci::into(image.rejection), soci::use(run));
  images.execute();
  while (images.fetch()) found->images.push_back(image);
  RunEvent event;
  soci::statement events =
      (sql.prepare << "SELECT event, what, who, text FROM events WHERE run = :run ORDER BY event",
       soci::into(event.event), soci::into(event.kind), soci::into(event.author),
       soci::into(event.text), soci::use(run));
  events.execute();
  while (events.fetch()) found->events.push_back(event);
  return found;
}

}  // namespace vlp
