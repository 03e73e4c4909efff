// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records.h"

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cmath>

#include "rig/child_process.h"
#include "station/export_runs.h"
#include "station/station_config.h"
#include "support/postgres_server.h"
#include "support/refused.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

RunRecord sample(const std::string& run, const std::string& camera, double rms_px) {
  RunRecord record;
  record.run = run;
  record.kind = "unit";
  record.station = "station-1";
  record.camera = camera;
  record.begun_utc = begun_utc(run);
  record.ended_utc = "2026-11-21T13:45:0" + run.substr(14, 1) + "Z";
  record.verdict = rms_px < 1 ? "PASS" : "FAIL";
  record.causes = rms_px < 1 ? "" : "it's \"blurred\": 100 %, \xc3\xbc\nsecond\n";
  record.program = "vlp-station 0";
  record.libraries = "none";
  record.config_sha256 = std::string(64, 'a');
  record.calibration = "format: vlp-calibration/1\ncamera: {id: \"it's\"}\n";
  record.figures = check_all({{"rms_px", 1}, {"tilt_deg", 2}},
                             {{"rms_px", rms_px}, {"coverage", 0.75}}, unit_metrics());
  record.images = {{"boards", "0000.png", std::string(64, 'b'), ""},
                   {"check", "0000.png", std::string(64, 'c'), "too dark"}};
  return record;
}

std::string run_of(int number) {
  return "20261121T13450" + std::to_string(number % 10) + "Z-" + std::to_string(1000 + number);
}

/// What holds in every database.
void check_records(const std::string& where) {
  Records records(where);
  for (int i = 0; i < 4; ++i) {
    records.keep(sample(run_of(i), i == 2 ? "b" : "a", i == 3 ? 1.5 : 0.1 * i));
  }
  // Kept once, and as it was the first time.
  records.keep(sample(run_of(0), "other", 0.7));
  const auto all = records.list({});
  ASSERT_THAT(all, SizeIs(4));
  EXPECT_EQ(all[0].camera, "a");
  EXPECT_EQ(all[3].verdict, "FAIL");
  RunFilter filter;
  filter.camera = "a";
  EXPECT_THAT(records.list(filter), SizeIs(3));
  filter.verdict = "PASS";
  filter.last = 1;
  ASSERT_THAT(records.list(filter), SizeIs(1));
  EXPECT_EQ(records.list(filter)[0].run, run_of(1));

  EXPECT_TRUE(records.has(run_of(3)));
  EXPECT_FALSE(records.has("another"));
  EXPECT_FALSE(records.find("another"));
  const auto found = records.find(run_of(3));
  ASSERT_TRUE(found);
  const RunRecord expected = sample(run_of(3), "a", 1.5);
  EXPECT_EQ(found->causes, expected.causes);
  EXPECT_EQ(found->calibration, expected.calibration);
  ASSERT_THAT(found->figures, SizeIs(3));
  EXPECT_EQ(found->figures[0].value, 1.5);
  EXPECT_FALSE(found->figures[0].met());
  EXPECT_EQ(found->figures[0].unit, "px");
  EXPECT_FALSE(found->figures[1].limit);
  EXPECT_EQ(found->figures[1].asked, Direction::at_least);
  EXPECT_FALSE(found->figures[2].value);
  ASSERT_THAT(found->images, SizeIs(2));
  EXPECT_EQ(found->images[1].refused, "too dark");

  RunFilter of_a;
  of_a.camera = "a";
  const auto trend = records.trend("rms_px", of_a);
  ASSERT_THAT(trend, SizeIs(3));
  EXPECT_DOUBLE_EQ(trend[2].value, 1.5);
  EXPECT_THAT(records.trend("tilt_deg", {}), IsEmpty());
}

/// Two programs that write at the same time, the first also makes the tables.
void check_two_writers(const std::string& where) {
  constexpr int each = 25;
  std::vector<pid_t> children;
  for (int writer = 0; writer < 2; ++writer) {
    children.push_back(start_child([&] {
      Records records(where);
      for (int i = 0; i < each; ++i) {
        records.keep(sample(run_of(100 * (writer + 1) + i), writer == 0 ? "a" : "b", 0.1));
      }
    }));
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  Records records(where);
  const auto runs = records.list({});
  EXPECT_THAT(runs, SizeIs(2 * each));
  for (const RunSummary& run : runs) EXPECT_THAT(records.find(run.run)->images, SizeIs(2));
}

/// Records as version 1 of their tables kept them.
const std::string kVersion1 = R"(
CREATE TABLE vlp_schema (version INTEGER PRIMARY KEY);
INSERT INTO vlp_schema (version) VALUES (1);
CREATE TABLE runs (run VARCHAR(64) PRIMARY KEY, kind TEXT NOT NULL, station TEXT NOT NULL,
  camera TEXT NOT NULL, begun_utc TEXT NOT NULL, ended_utc TEXT NOT NULL, verdict TEXT NOT NULL,
  causes TEXT NOT NULL, program TEXT NOT NULL, libraries TEXT NOT NULL,
  config_sha256 TEXT NOT NULL, calibration TEXT NOT NULL);
CREATE TABLE figures (run VARCHAR(64) NOT NULL REFERENCES runs (run), place INTEGER NOT NULL,
  name VARCHAR(64) NOT NULL, value DOUBLE PRECISION, gate DOUBLE PRECISION,
  at_least INTEGER NOT NULL, met INTEGER NOT NULL, PRIMARY KEY (run, name));
CREATE TABLE images (run VARCHAR(64) NOT NULL REFERENCES runs (run), step VARCHAR(16) NOT NULL,
  image VARCHAR(255) NOT NULL, sha256 TEXT NOT NULL, refused TEXT NOT NULL,
  PRIMARY KEY (run, step, image));
CREATE INDEX runs_by_camera ON runs (camera);
INSERT INTO runs VALUES ('20261121T134501Z-0001', 'unit', 'station-1', 'a',
  '2026-11-21T13:45:01Z', '2026-11-21T13:55:01Z', 'FAIL', 'blurred', 'vlp-station 0.1.0', 'none',
  'aa', 'format: vlp-calibration/1');
INSERT INTO figures VALUES ('20261121T134501Z-0001', 1, 'rms_px', 1.5, 1, 0, 0);
INSERT INTO figures VALUES ('20261121T134501Z-0001', 2, 'coverage', NULL, 0.7, 1, 0);
INSERT INTO images VALUES ('20261121T134501Z-0001', 'boards', '0000.png', 'bb', '');
)";

/// Of a database that holds kVersion1; two programs that open it at once bring it up to date.
void check_migration(const std::string& where) {
  std::vector<pid_t> children;
  for (int i = 0; i < 2; ++i) children.push_back(start_child([&] { Records records(where); }));
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  Records records(where);
  const auto found = records.find("20261121T134501Z-0001");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->station, "station-1");
  EXPECT_EQ(found->begun_utc, "2026-11-21T13:45:01Z");
  EXPECT_EQ(found->calibration, "format: vlp-calibration/1");
  ASSERT_THAT(found->figures, SizeIs(2));
  EXPECT_EQ(words_of(found->figures[0]), "rms_px is 1.5 px, at most 1 px is asked for");
  EXPECT_EQ(words_of(found->figures[1]), "coverage is not known, at least 0.7 is asked for");
  EXPECT_THAT(found->images, SizeIs(1));
  records.keep(sample(run_of(5), "b", 0.1));
  EXPECT_THAT(records.list({}), SizeIs(2));
  EXPECT_EQ(records.find(run_of(5))->figures[0].unit, "px");
}

/// Runs SQL in a file of SQLite.
void run_sqlite(const TemporaryFolder& folder, const std::string& sql) {
  folder.file("run.py",
              "import sqlite3, sys\nsqlite3.connect(sys.argv[1]).executescript(sys.argv[2])\n");
  ASSERT_EQ(std::system(("python3 '" + (folder / "run.py").string() + "' '" +
                         (folder / "records.db").string() + "' \"" + sql + "\"")
                            .c_str()),
            0);
}

TEST(Records, OfVersion1InAFileAreBroughtUpToDate) {
  const TemporaryFolder folder;
  run_sqlite(folder, kVersion1);
  check_migration((folder / "records.db").string());
}

TEST(Records, OfVersion1InPostgresAreBroughtUpToDate) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  ASSERT_EQ(std::system(("psql -q '" + server.uri() + "' -c \"" + kVersion1 + "\"").c_str()), 0);
  check_migration(server.uri());
}

TEST(Records, OfALaterVersionAreLeftAlone) {
  const TemporaryFolder folder;
  run_sqlite(folder, kVersion1 + "UPDATE vlp_schema SET version = 99;");
  EXPECT_THAT(refusal_of([&] { Records records((folder / "records.db").string()); }),
              HasSubstr("version 99"));
}

TEST(Records, AreKeptInAFile) {
  const TemporaryFolder folder;
  check_records((folder / "records.db").string());
}

TEST(Records, OfTwoStationsInOneFileLoseNothing) {
  const TemporaryFolder folder;
  check_two_writers((folder / "records.db").string());
}

TEST(Records, AreKeptInPostgres) {
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  check_two_writers(server.uri());
  ASSERT_EQ(std::system(
                ("psql -q '" + server.uri() + "' -c 'DROP TABLE figures, images, runs, vlp_schema'")
                    .c_str()),
            0);
  check_records(server.uri());

  // The server ends the connection, as one that is started anew does.
  Records records(server.uri());
  ASSERT_EQ(std::system(("psql -q '" + server.uri() +
                         "' -o /dev/null -c 'SELECT pg_terminate_backend(pid) FROM "
                         "pg_stat_activity WHERE pid <> pg_backend_pid()'")
                            .c_str()),
            0);
  records.keep(sample(run_of(9), "c", 0.1));
  EXPECT_TRUE(records.has(run_of(9)));
}

TEST(Records, RefuseAFileThatIsNoDatabase) {
  const TemporaryFolder folder;
  const auto file = folder.file("records.db", std::string(5000, 'x'));
  EXPECT_THAT(refusal_of([&] { Records records(file.string()); }),
              testing::AllOf(HasSubstr("records.db"), HasSubstr("not a database")));
}

TEST(Records, DoNotTellThePasswordOfAServer) {
  EXPECT_THAT(
      refusal_of([] { Records records("postgresql://vlp:secret@/postgres?host=/nowhere"); }),
      testing::AllOf(HasSubstr("/nowhere"), testing::Not(HasSubstr("secret"))));
}

TEST(ExportRuns, WritesCsvAndJson) {
  const TemporaryFolder folder;
  const std::vector<RunRecord> runs{sample(run_of(1), "a", 0.25), sample(run_of(2), "b", 1.5)};
  write_runs(folder / "runs.csv", runs);
  const std::string csv = TemporaryFolder::content_of(folder / "runs.csv");
  EXPECT_THAT(csv, HasSubstr("run,kind,station,camera,begun_utc"));
  EXPECT_THAT(csv, HasSubstr("2026-11-21T13:45:01Z,2026-11-21T13:45:01Z,PASS"));
  EXPECT_THAT(csv, HasSubstr("; second"));
  write_runs(folder / "runs.json", runs);
  const std::string json = TemporaryFolder::content_of(folder / "runs.json");
  EXPECT_THAT(json, HasSubstr("\"value\": 0.25"));
  EXPECT_THAT(json, HasSubstr("\"tilt_deg\": {\n    \"value\": null"));
  EXPECT_THAT(refusal_of([&] { write_runs(folder / "runs.txt", runs); }), HasSubstr(".csv"));
}

}  // namespace
}  // namespace vlp
