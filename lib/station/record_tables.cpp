// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/record_tables.h"

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "station/run_record.h"
#include "station/station_config.h"

namespace vlp {
namespace {

/// Version 2: a figure has its unit.
constexpr int kSchema = 2;

constexpr const char* kFigures =  // gate: no limit is no gate
    "CREATE TABLE IF NOT EXISTS figures (run VARCHAR(64) NOT NULL REFERENCES runs (run), "
    "place INTEGER NOT NULL, name VARCHAR(64) NOT NULL, value DOUBLE PRECISION, "
    "gate DOUBLE PRECISION, at_least INTEGER NOT NULL, met INTEGER NOT NULL, "
    "unit VARCHAR(16) NOT NULL DEFAULT '', PRIMARY KEY (run, name))";

constexpr const char* kImages =
    "CREATE TABLE IF NOT EXISTS images (run VARCHAR(64) NOT NULL REFERENCES runs (run), "
    "step VARCHAR(16) NOT NULL, image VARCHAR(255) NOT NULL, sha256 TEXT NOT NULL, "
    "refused TEXT NOT NULL, PRIMARY KEY (run, step, image))";

std::vector<std::string> tables() {
  std::string runs = "CREATE TABLE IF NOT EXISTS runs (run VARCHAR(64) PRIMARY KEY";
  for (const RunField& field : run_fields().subspan(1)) {
    runs.append(", ").append(field.name).append(" TEXT NOT NULL");
  }
  runs += ")";
  return {"CREATE TABLE IF NOT EXISTS vlp_schema (version INTEGER PRIMARY KEY)", runs, kFigures,
          kImages, "CREATE INDEX IF NOT EXISTS runs_by_camera ON runs (camera)"};
}

void from_1_to_2(soci::session& sql) {
  sql << "ALTER TABLE figures ADD COLUMN unit VARCHAR(16) NOT NULL DEFAULT ''";
  for (const MetricKind& kind : unit_metrics()) {
    const std::string name = kind.name, unit = kind.unit;
    sql << "UPDATE figures SET unit = :unit WHERE name = :name", soci::use(unit), soci::use(name);
  }
}

/// From each version to the next; the first is of version 1.
constexpr std::array kMigrations{from_1_to_2};
static_assert(kMigrations.size() + 1 == kSchema);

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
  if (version > kSchema) {
    throw std::runtime_error("holds records of version " + std::to_string(version) +
                             ", which this program does not know: it is older than they are");
  }
  soci::transaction transaction(sql);
  if (version == 0) {
    for (const std::string& table : tables()) sql << table;
    if (schema_of(sql) == 0) {
      sql << "INSERT INTO vlp_schema (version) VALUES (:version)", soci::use(kSchema);
    }
  } else {
    // A write waits for others that do the same; what they did is seen after it.
    sql << "UPDATE vlp_schema SET version = version";
    for (version = schema_of(sql); version < kSchema; ++version) {
      kMigrations.at(static_cast<std::size_t>(version) - 1)(sql);
    }
    sql << "UPDATE vlp_schema SET version = :version", soci::use(kSchema);
  }
  transaction.commit();
}

}  // namespace vlp
