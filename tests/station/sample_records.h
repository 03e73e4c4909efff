// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "station/records/records.h"
#include "station/station_config.h"
#include "support/temporary_folder.h"

namespace vlp {

inline RunRecord make_sample_record(const std::string& run, const std::string& camera,
                                    double rms_px) {
  RunRecord record;
  record.run = run;
  record.kind = "unit";
  record.station = "station-1";
  record.camera = camera;
  record.begun_utc = start_utc_of_run_id(run);
  record.ended_utc = "2026-11-21T13:45:0" + run.substr(14, 1) + "Z";
  record.verdict = rms_px < 1 ? "PASS" : "FAIL";
  record.causes = rms_px < 1 ? "" : "it's \"blurred\": 100 %, \xc3\xbc\nsecond\n";
  record.program = "vlp-station 0";
  record.libraries = "none";
  record.config_sha256 = std::string(64, 'a');
  record.calibration = "format: vlp-calibration/1\ncamera: {id: \"it's\"}\n";
  record.metrics =
      check_against_gates({{"rms_px", 1, GuardBand{0.1 + 0.2, 1.5}}, {"tilt_deg", 2}},
                          {{"rms_px", rms_px}, {"coverage", 0.75}}, list_unit_metrics());
  record.images = {{"boards", "0000.png", std::string(64, 'b'), ""},
                   {"check", "0000.png", std::string(64, 'c'), "too dark"}};
  return record;
}

inline std::string numbered_run_id(int number) {
  return "20261121T13450" + std::to_string(number % 10) + "Z-" + std::to_string(1000 + number);
}

/// Returns the ids of the runs that match the filter, of Records or a Spool.
template <typename Runs>
std::vector<std::string> list_ids(Runs& runs, const RunFilter& filter) {
  std::vector<std::string> ids;
  for (const RunSummary& run : runs.list_run_summaries(filter)) ids.push_back(run.run);
  return ids;
}

/// Returns the runs of a station, or of all, with an open hook.
template <typename Runs>
std::vector<std::string> list_open_hooks(Runs& runs, const std::string& station = "") {
  return list_ids(runs, {.station = station, .has_open_hook = true});
}

/// Returns the output of a database client that is independent of Records. `sql` has one statement
/// per line; lines that begin with "\! " are shell commands.
inline std::string run_database_client(const std::string& where, const std::string& sql) {
  const TemporaryFolder folder;
  const std::string script = folder.file("script.sql", sql).string();
  const std::string answer = (folder / "answer").string();
  const std::string sqlite = folder
                                 .file("client.py", R"(import os, sqlite3, sys
database = sqlite3.connect(sys.argv[1], isolation_level=None)
for line in open(sys.argv[2]):
    if line.startswith("\\! "):
        os.system(line[3:])
    else:
        for row in database.execute(line):
            print(*row, sep="|")
)")
                                 .string();
  const bool is_server_address = where.starts_with("postgresql://");
  const std::string client = is_server_address
                                 ? "psql -X -q -A -t -v ON_ERROR_STOP=1 '" + where + "' -f "
                                 : "python3 " + sqlite + " '" + where + "' ";
  EXPECT_EQ(std::system((client + script + " >" + answer).c_str()), 0) << sql;
  return TemporaryFolder::read_content(answer);
}

/// Empties a database of PostgreSQL.
inline const std::string kDropAll = "DROP SCHEMA public CASCADE;\nCREATE SCHEMA public;\n";

}  // namespace vlp
