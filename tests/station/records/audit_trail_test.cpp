// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/audit_trail.h"

#include <gmock/gmock.h>

#include <functional>
#include <string>
#include <vector>

#include "station/records/records.h"
#include "station/sample_records.h"
#include "support/postgres_server.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

const std::string kRun1 = numbered_run_id(1), kRun2 = numbered_run_id(2),
                  kRun3 = numbered_run_id(3);
const std::string kLabel = "20261121T134505.000000Z-00000001",
                  kDeleted = "20261121T134506.000000Z-00000002";

/// Stores entries 1 to 5: runs 1 and 2, the hook of 2, run 3, and the deletion of its images.
void keep_three(const std::string& where) {
  Records records(where);
  RunRecord first = make_sample_record(kRun1, "a", 0.1),
            second = make_sample_record(kRun2, "b", 1.0 / 3),
            third = make_sample_record(kRun3, "c", 1.5);
  second.events = {{kLabel, kHookDone, "label 7", "Ann (vlp@station-1)"}};
  third.events = {{kDeleted, kImagesDeleted, "kept 90 days", "vlp@station-1"}};
  for (const RunRecord& run : {first, second, third, second}) records.store_run(run);
}

struct Forgery {
  std::string sql;
  std::vector<std::string> problems;
};

const std::vector<Forgery>& forgeries() {
  static const std::string without_3 = "DELETE FROM figures WHERE run = '" + kRun3 +
                                       "';\nDELETE FROM images WHERE run = '" + kRun3 +
                                       "';\nDELETE FROM events WHERE run = '" + kRun3 +
                                       "';\nDELETE FROM runs WHERE run = '" + kRun3 + "';\n";
  static const std::vector<Forgery> all{
      {"UPDATE runs SET verdict = 'PASS', causes = '' WHERE run = '" + kRun3 + "';\n",
       {"run " + kRun3 + " was changed"}},
      {"UPDATE figures SET value = 0.3333 WHERE run = '" + kRun2 + "' AND name = 'rms_px';\n",
       {"run " + kRun2 + " was changed"}},
      {"UPDATE figures SET gate = 2 WHERE run = '" + kRun3 + "' AND name = 'rms_px';\n",
       {"run " + kRun3 + " was changed"}},
      {"UPDATE images SET sha256 = 'another' WHERE run = '" + kRun1 + "' AND step = 'check';\n",
       {"run " + kRun1 + " was changed"}},
      {"DELETE FROM images WHERE run = '" + kRun1 + "' AND step = 'check';\n",
       {"run " + kRun1 + " was changed"}},
      {"UPDATE events SET who = 'Bob' WHERE event = '" + kLabel + "';\n",
       {"event " + kLabel + " of run " + kRun2 + " was changed"}},
      {"DELETE FROM events WHERE event = '" + kDeleted + "';\n",
       {"event " + kDeleted + " of run " + kRun3 + " was removed"}},
      {"INSERT INTO events (event, run, what, text) VALUES ('e', '" + kRun1 +
           "', 'hook done', '');\n",
       {"event e of run " + kRun1 + " has no entry in the trail: it was added by hand"}},
      {without_3,
       {"run " + kRun3 + " was removed",
        "event " + kDeleted + " of run " + kRun3 + " was removed"}},
      {"DELETE FROM trail WHERE number = 2;\n",
       {"entry 2 of the trail was removed",
        "run " + kRun2 + " has no entry in the trail: it was added by hand"}},
      {"DELETE FROM trail WHERE number IN (1, 2);\n",
       {"entries 1 to 2 of the trail were removed",
        "run " + kRun1 + " has no entry in the trail: it was added by hand",
        "run " + kRun2 + " has no entry in the trail: it was added by hand"}},
      {"UPDATE trail SET digest = 'another' WHERE number = 3;\n",
       {"entry 3 of the trail, of event " + kLabel + " of run " + kRun2 + ", was changed"}},
      {"UPDATE trail SET content = 'another' WHERE number = 4;\n",
       {"entry 4 of the trail, of run " + kRun3 + ", was changed",
        "run " + kRun3 + " was changed"}},
      {"INSERT INTO trail SELECT 6, run, event, content, digest FROM trail WHERE number = 1;\n",
       {"entry 6 of the trail, of run " + kRun1 + ", was changed",
        "entry 6 of the trail was added: run " + kRun1 + " has one already"}},
      // Removal of the last entries with their contents, detected by an earlier digest.
      {without_3 + "DELETE FROM trail WHERE number > 3;\n", {}},
  };
  return all;
}

/// Checks that manual changes are reported by id, and nothing else.
void check_forgeries(const std::function<std::string()>& new_database) {
  for (const Forgery& forgery : forgeries()) {
    const std::string where = new_database();
    keep_three(where);
    Records records(where);
    const TrailCheck kept = records.check_records_by_audit_trail("");
    EXPECT_THAT(kept.problems, IsEmpty());
    EXPECT_EQ(kept.runs, 3U);
    EXPECT_EQ(kept.entries, 5U);
    run_database_client(where, forgery.sql);
    EXPECT_EQ(records.check_records_by_audit_trail("").problems, forgery.problems) << forgery.sql;
    if (!forgery.problems.empty()) continue;
    EXPECT_THAT(
        records.check_records_by_audit_trail(kept.last_digest).problems,
        ElementsAre(StartsWith("the entry that was noted, " + kept.last_digest + ", is not in")));
  }
}

TEST(CheckAuditTrail, DetectsEachChangeOfSqliteRecords) {
  const TemporaryFolder folder;
  int count = 0;
  check_forgeries([&] { return (folder / (std::to_string(++count) + ".db")).string(); });
}

TEST(CheckAuditTrail, DetectsEachChangeOfPostgresRecords) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  check_forgeries([&] {
    run_database_client(server.uri(), kDropAll);
    return server.uri();
  });
}

/// An earlier last digest remains in the trail unless it is removed.
TEST(CheckAuditTrail, AcceptsEarlierLastDigestAfterNewRun) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  keep_three(where);
  Records records(where);
  const std::string expected_digest = records.check_records_by_audit_trail("").last_digest;
  EXPECT_THAT(expected_digest, SizeIs(64));
  records.store_run(make_sample_record(numbered_run_id(4), "d", 0.5));
  const TrailCheck later = records.check_records_by_audit_trail(expected_digest);
  EXPECT_THAT(later.problems, IsEmpty());
  EXPECT_EQ(later.entries, 6U);
  EXPECT_NE(later.last_digest, expected_digest);
}

/// Equal runs have equal digests in every database.
TEST(CheckAuditTrail, ReturnsSameDigestForPostgresAndSqlite) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  const TemporaryFolder folder;
  const std::string file = (folder / "records.db").string();
  keep_three(file);
  keep_three(server.uri());
  EXPECT_EQ(Records(file).check_records_by_audit_trail("").last_digest,
            Records(server.uri()).check_records_by_audit_trail("").last_digest);
}

/// Records in the tables of version 5, which had no trail.
const std::string kVersion5 =
    R"(CREATE TABLE vlp_schema (version INTEGER PRIMARY KEY);
INSERT INTO vlp_schema (version) VALUES (5);
CREATE TABLE runs (run VARCHAR(64) PRIMARY KEY, kind TEXT NOT NULL, station TEXT NOT NULL, )"
    R"(camera TEXT NOT NULL, operator_name TEXT NOT NULL, shift TEXT NOT NULL, )"
    R"(begun_utc TEXT NOT NULL, ended_utc TEXT NOT NULL, verdict TEXT NOT NULL, )"
    R"(causes TEXT NOT NULL, program TEXT NOT NULL, libraries TEXT NOT NULL, )"
    R"(config_sha256 TEXT NOT NULL, calibration TEXT NOT NULL);
CREATE TABLE figures (run VARCHAR(64) NOT NULL REFERENCES runs (run), place INTEGER NOT NULL, )"
    R"(name VARCHAR(64) NOT NULL, value DOUBLE PRECISION, gate DOUBLE PRECISION, )"
    R"(at_least INTEGER NOT NULL, met INTEGER NOT NULL, unit VARCHAR(16) NOT NULL DEFAULT '', )"
    R"(uncertainty DOUBLE PRECISION, guard_k DOUBLE PRECISION, PRIMARY KEY (run, name));
CREATE TABLE images (run VARCHAR(64) NOT NULL REFERENCES runs (run), step VARCHAR(16) NOT NULL, )"
    R"(image VARCHAR(255) NOT NULL, sha256 TEXT NOT NULL, refused TEXT NOT NULL, )"
    R"(PRIMARY KEY (run, step, image));
CREATE TABLE events (event VARCHAR(64) PRIMARY KEY, run VARCHAR(64) NOT NULL REFERENCES runs (run), )"
    R"(what VARCHAR(32) NOT NULL, text TEXT NOT NULL);
CREATE INDEX events_by_run ON events (run);
CREATE INDEX runs_by_camera ON runs (camera);
CREATE INDEX images_by_sha256 ON images (sha256);
INSERT INTO runs VALUES ('20261121T134509Z-0009', 'unit', 'station-1', 'a', 'Ann', 'late', )"
    R"('2026-11-21T13:45:09Z', '2026-11-21T13:55:09Z', 'FAIL', 'blurred', 'vlp-station 0.1.0', )"
    R"('none', 'aa', 'format: vlp-calibration/1');
INSERT INTO figures VALUES ('20261121T134509Z-0009', 1, 'rms_px', 1.5, 1, 0, 0, 'px', 0.1, 2);
INSERT INTO figures VALUES ('20261121T134509Z-0009', 2, 'coverage', NULL, 0.7, 1, 0, '', NULL, NULL);
INSERT INTO images VALUES ('20261121T134509Z-0009', 'boards', '0000.png', 'bb', '');
INSERT INTO events VALUES ('20261121T135510.000000Z-00000001', '20261121T134509Z-0009', )"
    R"('hook wanted', 'label');
INSERT INTO events VALUES ('20261121T135511.000000Z-00000002', '20261121T134509Z-0009', )"
    R"('hook failed', 'exit code 3');
)";

/// Checks that the migration of kVersion5 adds all existing runs to the trail.
void check_sealing(const std::string& where) {
  Records records(where);
  const TrailCheck sealed = records.check_records_by_audit_trail("");
  EXPECT_THAT(sealed.problems, IsEmpty());
  EXPECT_EQ(sealed.runs, 1U);
  EXPECT_EQ(sealed.entries, 3U);
  RunRecord run = records.find_run_by_id("20261121T134509Z-0009").value();
  EXPECT_EQ(run.operator_name, "Ann");
  ASSERT_THAT(run.events, SizeIs(2));
  EXPECT_EQ(run.events[1].text, "exit code 3");
  EXPECT_EQ(run.events[1].author, "");
  run.events.push_back(make_run_event_now(kHookDone, "", "Bob"));
  records.store_run(run);
  EXPECT_THAT(records.find_run_by_id(run.run)->events[2].author, StartsWith("Bob ("));
  EXPECT_EQ(records.check_records_by_audit_trail(sealed.last_digest).entries, 4U);
  EXPECT_THAT(records.check_records_by_audit_trail(sealed.last_digest).problems, IsEmpty());
  run_database_client(where, "UPDATE events SET text = 'label 7' WHERE what = 'hook failed';\n");
  EXPECT_THAT(records.check_records_by_audit_trail("").problems,
              ElementsAre("event 20261121T135511.000000Z-00000002 of run 20261121T134509Z-0009 was "
                          "changed"));
}

TEST(CheckAuditTrail, AddsRunsOfDatabaseVersion5ToTrail) {
  const TemporaryFolder folder;
  const std::string file = (folder / "records.db").string();
  run_database_client(file, kVersion5);
  check_sealing(file);
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  run_database_client(server.uri(), kVersion5);
  check_sealing(server.uri());
}

}  // namespace
}  // namespace vlp
