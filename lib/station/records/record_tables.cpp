// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/record_tables.h"

#include <algorithm>
#include <stdexcept>

namespace vlp {
namespace {

/// Returns the names of the columns of table `runs`, except its document.
std::string list_column_names(const char* separator) {
  std::string names;
  for (const RunField& field : list_run_fields()) {
    if (field.is_column) names.append(names.empty() ? "" : separator).append(field.name);
  }
  return names;
}

std::vector<std::string> list_table_statements() {
  return {
      "CREATE TABLE IF NOT EXISTS vlp_schema (version INTEGER PRIMARY KEY)",
      "CREATE TABLE IF NOT EXISTS runs (" + list_column_names(" TEXT NOT NULL, ") +
          " TEXT NOT NULL, document TEXT NOT NULL, destination TEXT NOT NULL, PRIMARY KEY (run))",
      "CREATE INDEX IF NOT EXISTS runs_by_camera ON runs (camera)",
      // value: NULL if it could not be measured; gate: NULL without a gate
      ("CREATE TABLE IF NOT EXISTS metrics (run TEXT NOT NULL REFERENCES runs (run), "
       "name TEXT NOT NULL, value DOUBLE PRECISION, gate DOUBLE PRECISION, "
       "PRIMARY KEY (run, name))"),
      ("CREATE TABLE IF NOT EXISTS images (run TEXT NOT NULL REFERENCES runs (run), "
       "sha256 TEXT NOT NULL, PRIMARY KEY (sha256, run))"),
      ("CREATE TABLE IF NOT EXISTS events (event TEXT PRIMARY KEY, "
       "run TEXT NOT NULL REFERENCES runs (run), what TEXT NOT NULL, text TEXT NOT NULL, "
       "who TEXT NOT NULL DEFAULT '')"),
      "CREATE INDEX IF NOT EXISTS events_by_run ON events (run)",
      // Without a reference to runs, so that an entry remains when its run is removed.
      ("CREATE TABLE IF NOT EXISTS trail (number BIGINT PRIMARY KEY, run TEXT NOT NULL, "
       "event TEXT NOT NULL, content TEXT NOT NULL, digest TEXT NOT NULL)")};
}

bool is_sqlite(soci::session& sql) { return sql.get_backend_name() == "sqlite3"; }

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

RunRows make_run_rows(std::string document) {
  const RunRecord run = parse_run_document(document);
  RunRows rows{std::move(document), {}, {}, {}};
  for (const RunField& field : list_run_fields()) {
    if (field.is_column) rows.columns.push_back(run.*field.text);
  }
  for (const CheckedMetric& metric : run.metrics) {
    rows.metrics[metric.name] = {metric.value, metric.limit};
  }
  for (const RunRecord::Image& image : run.images) {
    if (image.is_image_used()) rows.image_sha256.insert(image.sha256);
  }
  return rows;
}

RunRows load_run_rows(soci::session& sql, const std::string& run) {
  RunRows rows;
  rows.columns.resize(
      static_cast<std::size_t>(std::ranges::count_if(list_run_fields(), &RunField::is_column)));
  soci::statement columns(sql);
  for (std::string& column : rows.columns) columns.exchange(soci::into(column));
  columns.exchange(soci::into(rows.document));
  columns.exchange(soci::use(run, "run"));
  columns.alloc();
  columns.prepare("SELECT " + list_column_names(", ") + ", document FROM runs WHERE run = :run");
  columns.define_and_bind();
  columns.execute(true);
  std::string name;
  double value = 0, gate = 0;
  soci::indicator has_value = soci::i_null, has_gate = soci::i_null;
  soci::statement metrics =
      (sql.prepare << "SELECT name, value, gate FROM metrics WHERE run = :run", soci::into(name),
       soci::into(value, has_value), soci::into(gate, has_gate), soci::use(run));
  metrics.execute();
  while (metrics.fetch()) {
    auto& metric = rows.metrics[name];
    if (has_value == soci::i_ok) metric.first = value;
    if (has_gate == soci::i_ok) metric.second = gate;
  }
  const soci::rowset<std::string> images =
      (sql.prepare << "SELECT sha256 FROM images WHERE run = :run", soci::use(run));
  rows.image_sha256.insert(images.begin(), images.end());
  return rows;
}

std::optional<RunRecord> load_run(soci::session& sql, const std::string& run) {
  std::string document;
  sql << "SELECT document FROM runs WHERE run = :run", soci::into(document), soci::use(run);
  if (!sql.got_data()) return std::nullopt;
  try {
    RunRecord record = parse_run_document(document);
    record.events = load_run_events(sql, run);
    return record;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error("run " + run + " " + error.what());
  }
}

std::vector<RunEvent> load_run_events(soci::session& sql, const std::string& run) {
  RunEvent event;
  std::vector<RunEvent> loaded;
  soci::statement events =
      (sql.prepare << "SELECT event, what, who, text FROM events WHERE run = :run ORDER BY event",
       soci::into(event.event), soci::into(event.kind), soci::into(event.author),
       soci::into(event.text), soci::use(run));
  events.execute();
  while (events.fetch()) loaded.push_back(event);
  return loaded;
}

}  // namespace vlp
