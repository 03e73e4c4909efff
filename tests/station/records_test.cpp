// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records.h"

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cmath>

#include "rig/child_process.h"
#include "station/export_runs.h"
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
  record.ended_utc = "2026-11-21T13:45:0" + run.substr(14, 1) + "Z";
  record.verdict = rms_px < 1 ? "PASS" : "FAIL";
  record.causes = rms_px < 1 ? "" : "it's \"blurred\": 100 %, \xc3\xbc\nsecond\n";
  record.program = "vlp-station 0";
  record.libraries = "none";
  record.config_sha256 = std::string(64, 'a');
  record.calibration = "format: vlp-calibration/1\ncamera: {id: \"it's\"}\n";
  record.figures = {
      {"rms_px", rms_px, 1.0, false}, {"tilt_deg", {}, 2.0, false}, {"coverage", 0.75, {}, true}};
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
  EXPECT_FALSE(found->figures[1].value);
  EXPECT_FALSE(found->figures[2].limit);
  EXPECT_TRUE(found->figures[2].at_least);
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
