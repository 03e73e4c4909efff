// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// Version of the tables, stored in vlp_schema.
inline constexpr int kSchemaVersion = 7;

/// Returns true if the database has the tables. Takes no lock, so that users without write
/// permission can call it.
/// @throws soci::soci_error, and std::runtime_error if the tables have another version
bool has_record_tables(soci::session& sql);

/// Advisory lock of PostgreSQL for creating tables ("vlp").
inline constexpr int kTableLockId = 0x766c70;

/// Creates the tables of the records, identical in SQLite and PostgreSQL, unless they exist. Runs
/// in one transaction and in one program at a time. Throws soci::soci_error, and std::runtime_error
/// for tables of another version.
void create_record_tables(soci::session& sql);

/// Rows of a run: its document, and the values of it that queries use.
struct RunRows {
  /// serialize_run().
  std::string document;
  /// Row of table `runs`: list_run_fields() with RunField::is_column.
  std::vector<std::string> columns;
  /// Rows of table `metrics`: value and gate, if any, by name.
  std::map<std::string, std::pair<std::optional<double>, std::optional<double>>> metrics;
  /// Rows of table `images`: digests of the used images.
  std::set<std::string> image_sha256;

  friend bool operator==(const RunRows&, const RunRows&) = default;
};

/// Makes the rows of a run from its document.
/// @throws std::runtime_error as parse_run_document()
RunRows make_run_rows(std::string document);
/// Loads the rows of a run. Throws soci::soci_error.
/// @pre the run exists
RunRows load_run_rows(soci::session& sql, const std::string& run);

/// Loads a run from its document, with its events; std::nullopt if no run has this id. Throws
/// soci::soci_error, and std::runtime_error as parse_run_document().
std::optional<RunRecord> load_run(soci::session& sql, const std::string& run);
/// Loads the events of a run, in chronological order.
std::vector<RunEvent> load_run_events(soci::session& sql, const std::string& run);

}  // namespace vlp
