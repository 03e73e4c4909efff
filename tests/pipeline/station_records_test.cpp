// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station: what is done with the records: trends and studies, backups, what is kept how long,
/// what somebody changed.
#include <fmt/format.h>

#include <string>
#include <vector>

#include "small_station.h"
#include "support/postgres_server.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class VlpStationRecords : public SmallStation {};

/// Expired images of a run are deleted; its record, with an event for it, is kept.
TEST_F(VlpStationRecords, CleanDeletesExpiredImagesAndKeepsRecord) {
  prepare("0001");
  ASSERT_EQ(run_program(run("0001", "--idle-s 0.1")).exit_code, 3);
  EXPECT_EQ(records("clean").exit_code, 2);
  change("station.yaml", "records: records.db", "records: records.db\nretention: {images_days: 1}");
  EXPECT_THAT(records("clean").output, HasSubstr("0 folders, 0.0 MB"));
  // A hundred days ago, as the records and the folder have it.
  const std::string client =
      "import os, sqlite3, sys, time\n"
      "db = sqlite3.connect(sys.argv[1] + '/records.db', isolation_level=None)\n"
      "run = db.execute('SELECT run FROM runs').fetchone()[0]\n"
      "past = time.gmtime(time.time() - 100 * 86400)\n"
      "old = time.strftime('%Y%m%dT%H%M%SZ', past) + run[16:]\n"
      "ended = time.strftime('%Y-%m-%dT%H:%M:%SZ', past)\n"
      "was = db.execute('SELECT ended_utc FROM runs').fetchone()[0]\n"
      "db.execute('UPDATE runs SET run = ?, ended_utc = ?, '\n"
      "           'document = replace(replace(document, run, ?), ?, ?)',\n"
      "           (old, ended, old, was, ended))\n"
      "db.execute('UPDATE metrics SET run = ?', (old,))\n"
      "db.execute('UPDATE images SET run = ?', (old,))\n"
      "os.rename(sys.argv[1] + '/captures/0001.' + run, sys.argv[1] + '/captures/0001.' + old)\n";
  const auto aged = run_program("python3 " + folder.file("age.py", client).string() + " " +
                                (folder / "station").string());
  ASSERT_EQ(aged.exit_code, 0) << aged.errors;
  const auto dry = records("clean");
  EXPECT_THAT(dry.output, AllOf(HasSubstr("captures/0001."),
                                HasSubstr("1 folders, 0.0 MB: --delete deletes them")));
  EXPECT_FALSE(fs::is_empty(folder / "station/captures"));
  EXPECT_THAT(records("clean --delete").output, HasSubstr("1 folders, 0.0 MB deleted"));
  EXPECT_TRUE(fs::is_empty(folder / "station/captures"));
  EXPECT_THAT(records("show").output,
              ContainsRegex("images deleted 20[0-9TZ:-]+ [^ ]+@[^ ]*: kept 1 days"));
  EXPECT_THAT(records("clean").output, HasSubstr("0 folders"));
  EXPECT_THAT(records("list").output, HasSubstr("1 runs"));
}

/// Manual changes of the database are detected.
TEST_F(VlpStationRecords, VerifyRecordsCommandFailsWhenRunWasChanged) {
  prepare("0001");
  ASSERT_EQ(run_program(run("0001", "--idle-s 0.1")).exit_code, 3);
  const auto kept = records("verify-records");
  EXPECT_EQ(kept.exit_code, 0) << kept.errors;
  EXPECT_THAT(kept.output,
              testing::MatchesRegex("1 runs, 1 entries in the trail\nlast digest [0-9a-f]{64}\n"));
  const std::string noted = kept.output.substr(kept.output.find("digest ") + 7, 64);
  EXPECT_EQ(records("verify-records --expected-digest " + noted).exit_code, 0);
  const std::string client =
      "import sqlite3, sys\n"
      "db = sqlite3.connect(sys.argv[1], isolation_level=None)\n"
      "db.execute(\"UPDATE runs SET verdict = 'PASS', causes = ''\")\n";
  const std::string database = (folder / "station/records.db").string();
  ASSERT_EQ(
      run_program("python3 " + folder.file("pass.py", client).string() + " " + database).exit_code,
      0);
  const auto changed = run_program("vlp-station verify-records --records " + database +
                                   " --expected-digest " + std::string(64, '0'));
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(
      changed.output,
      ContainsRegex("run 20[0-9TZ]+-[0-9a-f]{16} was changed\nthe entry that was noted, 0{64}, "
                    "is not in the trail"));
  EXPECT_THAT(
      changed.errors,
      ContainsRegex("error: the records were changed: run 20[^ ]+ was changed, and 1 more\n"));
}

/// A voided run, with operator and reason.
TEST_F(VlpStationRecords, VoidCommandStoresOperatorAndReasonAndRemovesVerdict) {
  prepare("0001");
  ASSERT_EQ(run_program(run("0001", "--idle-s 0.1")).exit_code, 3);
  const std::string listed = records("list").output;
  const std::string name = listed.substr(listed.find("\n20") + 1, 33);
  EXPECT_EQ(records("void " + name + " --operator Ann").exit_code, 2) << "no reason";
  const std::string voiding = "void " + name + " --operator Ann --reason 'wrong serial'";
  const auto done = records(voiding);
  EXPECT_EQ(done.exit_code, 0) << done.errors;
  EXPECT_EQ(done.output, name + " 0001 INVALID: voided\n");
  EXPECT_THAT(
      records(voiding).errors,
      ContainsRegex("run " + name + " was voided before, by Ann [(].*@.*[)]: wrong serial"));
  EXPECT_THAT(records("list").output,
              AllOf(ContainsRegex(" VOID +unit .* was INVALID: wrong serial\n"),
                    HasSubstr("1 runs, 0 passed, 0 failed, 0 invalid, 1 voided\n")));
  EXPECT_THAT(
      records("show").output,
      AllOf(HasSubstr("Cause    was voided by Ann ("), HasSubstr("NO VERDICT   camera 0001"),
            ContainsRegex("voided +20[0-9TZ:-]+ Ann [(].*: wrong serial\n")));
  EXPECT_THAT(records("restore " + name).errors, HasSubstr("was voided by Ann"));
  EXPECT_THAT(records("certificate " + name).errors, HasSubstr("it has no certificate"));
  EXPECT_THAT(records("verify-records").output, HasSubstr("1 runs, 2 entries in the trail\n"));
}

/// The recipe of apps/vlp-station.md, "Backup", with SQLite and with PostgreSQL.
TEST_F(VlpStationRecords, OutputOfShowCommandIsUnchangedAfterRestoreFromBackup) {
  const std::string backup = (folder / "backup").string(), here = (folder / "station").string();
  fs::create_directory(backup);
  prepare("0001");
  ASSERT_EQ(run_program(run("0001", "--idle-s 0.1")).exit_code, 3);
  const std::string shown = records("show").output;
  if (run_program("command -v sqlite3").exit_code == 0) {
    const auto made = run_program("cd " + here + " && sqlite3 records.db \".backup '" + backup +
                                  "/records.db'\"");
    ASSERT_EQ(made.exit_code, 0) << made.errors;
    fs::remove(folder / "station/records.db");
    EXPECT_EQ(records("show").exit_code, 2);
    fs::copy_file(folder / "backup/records.db", folder / "station/records.db");
    EXPECT_EQ(records("show").output, shown);
  }
  if (!PostgresServer::installed()) GTEST_SKIP() << "PostgreSQL is not installed";
  const PostgresServer server;
  ASSERT_NE(server.uri(), "");
  change("station.yaml", "records: records.db", "records: \"" + server.uri() + "\"");
  ASSERT_EQ(run_program(run("0002", "--idle-s 0.1 --operator Ann")).exit_code, 3);
  const std::string of_server = records("show").output;
  const auto dumped = run_program("pg_dump --format=custom --file=" + backup + "/records.dump '" +
                                  server.uri() + "'");
  ASSERT_EQ(dumped.exit_code, 0) << dumped.errors;
  std::string empty = server.uri();
  empty.replace(empty.find("/postgres?"), 10, "/restored?");
  ASSERT_EQ(run_program("psql -q '" + server.uri() + "' -c 'CREATE DATABASE restored'").exit_code,
            0);
  const auto restored =
      run_program("pg_restore --no-owner --dbname='" + empty + "' " + backup + "/records.dump");
  ASSERT_EQ(restored.exit_code, 0) << restored.errors;
  change("station.yaml", server.uri(), empty);
  EXPECT_EQ(records("show").output, of_server);
  EXPECT_THAT(of_server, HasSubstr("operator   Ann\n"));
  EXPECT_THAT(records("verify-records").output, HasSubstr("1 runs, 1 entries in the trail\n"));
  // And it goes on.
  ASSERT_EQ(run_program(run("0003", "--idle-s 0.1")).exit_code, 3);
  EXPECT_THAT(records("list").output, HasSubstr("2 runs"));
}

TEST_F(VlpStationRecords, TrendAndStudiesUseComparableRunsAndTrendExitsWith1ForOutlier) {
  render_four_boards();
  ASSERT_EQ(run_program(batch()).exit_code, 3);  // makes the tables
  const auto add = [&](int first, const std::string& of, const std::string& kind,
                       const std::string& verdict, const std::vector<double>& values,
                       const std::string& camera = "a") {
    std::string sql;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::string run = std::to_string(first + static_cast<int>(i));
      // Runs end in different years.
      sql += fmt::format(
          "INSERT INTO runs SELECT '{0}', '{1}', '{2}', '{3}', '', '', '', "
          "'2{0}-01-01T00:00:00Z', '{4}', '', '', '', document, '' FROM runs LIMIT 1;\n"
          "INSERT INTO metrics VALUES ('{0}', 'rms_px', {5}, NULL);\n",
          run, kind, of, camera, verdict, values[i]);
    }
    const auto client = folder.file("client.py",
                                    "import sqlite3, sys\n"
                                    "sqlite3.connect(sys.argv[1], isolation_level=None)"
                                    ".executescript(open(sys.argv[2]).read())\n");
    const auto script = folder.file("add.sql", sql);
    const auto done = run_program("python3 " + client.string() + " " +
                                  (folder / "station/records.db").string() + " " + script.string());
    EXPECT_EQ(done.exit_code, 0) << done.errors;
  };
  add(100, "station-1", "unit", "PASS", std::vector<double>(10, 1));
  // Others are not mixed in unless they are asked for.
  add(200, "station-1", "golden", "PASS", {5});
  add(300, "station-1", "unit", "FAIL", {7, 8});
  add(400, "station-2", "unit", "PASS", {9});
  add(450, "station-1", "unit", "INVALID", {9});
  const auto steady = records("trend rms_px");
  EXPECT_EQ(steady.exit_code, 0) << steady.output << steady.errors;
  EXPECT_THAT(steady.output, HasSubstr("10 runs"));
  EXPECT_THAT(records("trend rms_px --verdict FAIL").output, HasSubstr("2 runs"));
  EXPECT_THAT(records("trend rms_px --kind any").output, HasSubstr("11 runs"));
  EXPECT_THAT(records("trend rms_px --of-station any").output, HasSubstr("11 runs"));
  add(500, "station-1", "unit", "PASS", {7, 1});
  const auto alarm = records("trend rms_px");
  EXPECT_EQ(alarm.exit_code, 1);
  EXPECT_THAT(alarm.output,
              HasSubstr("2500-01-01T00:00:00Z 500 a 7  western-electric-1: more than 3 sigmas"));
  const auto earlier = records("trend rms_px --window 1");
  EXPECT_EQ(earlier.exit_code, 0);
  EXPECT_THAT(earlier.output, HasSubstr("500 a 7  western-electric-1"));
  EXPECT_THAT(records("trend rms_px --rules nelson ewma").output, HasSubstr("nelson-1: "));
  EXPECT_EQ(records("trend rms_px --rules western-electric-2").exit_code, 0);
  EXPECT_THAT(records("trend rms_px --until 2200-01-01").output,
              HasSubstr("10 runs, 2100-01-01T00:00:00Z to 2109-01-01T00:00:00Z"));
  EXPECT_EQ(records("list --since 2026-02-30").exit_code, 2);

  // Failed units count in the capability; those that were not judged do not.
  EXPECT_THAT(records("capability rms_px").output, ContainsRegex("rms_px +14 .*<= 0.014 +-"));
  EXPECT_EQ(records("capability tilt_deg").exit_code, 3);
  for (const int which : {0, 1}) {
    const std::string camera = which == 0 ? "m1" : "m2";
    add(600 + 20 * which, "station-1", "unit", "PASS", {which + 1.0, which + 1.2}, camera);
    add(610 + 20 * which, "station-2", "unit", "PASS", {which + 1.1, which + 1.3}, camera);
  }
  // By hand: squares of units 2, stations 0.02, both 0, error 0.08 with 4 + 1 degrees of freedom.
  const auto study = records("study rms_px --units m1 m2");
  EXPECT_EQ(study.exit_code, 0) << study.errors;
  EXPECT_THAT(study.output,
              AllOf(HasSubstr("2 units, 2 stations, 2 runs each, mean 1.65 px"),
                    ContainsRegex("\\(EV\\) +0.12649"), ContainsRegex("\\(GRR\\) +0.13038")));
  // By hand: of station-1 alone, 1 and 1.2, 2 and 2.2.
  const auto bias =
      records("study rms_px --reference m1=1 m2=2.1 -o " + (folder / "bias.svg").string());
  EXPECT_EQ(bias.exit_code, 0) << bias.errors;
  EXPECT_THAT(
      bias.output,
      AllOf(ContainsRegex("m1 +1 +2 +0[.]1 +0[.]1 +1[.]00 +0[.]5000   -1[.]171 to 1[.]371\n"),
            ContainsRegex("all +0[.]05 "), ContainsRegex("slope +-0[.]09091 ")));
  EXPECT_THAT(TemporaryFolder::read_content(folder / "bias.svg"), HasSubstr("<svg"));
  for (const char* wrong : {"m1", "m1=1x", "=1", "m1=nan", "m1=1 m1=2"}) {
    const auto refused = records(std::string("study rms_px --reference ") + wrong);
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_THAT(refused.errors, HasSubstr("--reference: ")) << wrong;
  }
  EXPECT_EQ(records("study rms_px --units m1").exit_code, 3);
}

}  // namespace
}  // namespace vlp
