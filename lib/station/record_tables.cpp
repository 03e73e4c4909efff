// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/record_tables.h"

#include <array>
#include <stdexcept>
#include <string>

namespace vlp {
namespace {

constexpr int kSchema = 1;

constexpr std::array kTables{
    "CREATE TABLE IF NOT EXISTS vlp_schema (version INTEGER PRIMARY KEY)",
    "CREATE TABLE IF NOT EXISTS runs (run VARCHAR(64) PRIMARY KEY, kind TEXT NOT NULL, "
    "station TEXT NOT NULL, camera TEXT NOT NULL, begun_utc TEXT NOT NULL, "
    "ended_utc TEXT NOT NULL, verdict TEXT NOT NULL, causes TEXT NOT NULL, "
    "program TEXT NOT NULL, libraries TEXT NOT NULL, config_sha256 TEXT NOT NULL, "
    "calibration TEXT NOT NULL)",
    // gate: no limit is no gate
    "CREATE TABLE IF NOT EXISTS figures (run VARCHAR(64) NOT NULL REFERENCES runs (run), "
    "place INTEGER NOT NULL, name VARCHAR(64) NOT NULL, value DOUBLE PRECISION, "
    "gate DOUBLE PRECISION, at_least INTEGER NOT NULL, met INTEGER NOT NULL, "
    "PRIMARY KEY (run, name))",
    "CREATE TABLE IF NOT EXISTS images (run VARCHAR(64) NOT NULL REFERENCES runs (run), "
    "step VARCHAR(16) NOT NULL, image VARCHAR(255) NOT NULL, sha256 TEXT NOT NULL, "
    "refused TEXT NOT NULL, PRIMARY KEY (run, step, image))",
    "CREATE INDEX IF NOT EXISTS runs_by_camera ON runs (camera)",
};

int schema_of(soci::session& sql) {
  int version = 0, count = 0;
  sql << "SELECT COUNT(*) FROM vlp_schema", soci::into(count);
  if (count > 0) sql << "SELECT MAX(version) FROM vlp_schema", soci::into(version);
  return version;
}

}  // namespace

void make_record_tables(soci::session& sql) {
  int version = 0;
  try {
    version = schema_of(sql);
  } catch (const soci::soci_error&) {  // no such table
  }
  if (version == kSchema) return;
  if (version != 0) {
    throw std::runtime_error("holds records of version " + std::to_string(version) +
                             ", which this program does not know");
  }
  soci::transaction transaction(sql);
  for (const char* table : kTables) sql << table;
  if (schema_of(sql) == 0) {
    sql << "INSERT INTO vlp_schema (version) VALUES (:version)", soci::use(kSchema);
  }
  transaction.commit();
}

}  // namespace vlp
