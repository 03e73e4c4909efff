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
const std::string kLabel = "20261121T134505Z-0000000000000001",
                  kDeleted = "20261121T134506Z-0000000000000002";

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
  static const std::string without_3 = "DELETE FROM metrics WHERE run = '" + kRun3 +
                                       "';\nDELETE FROM images WHERE run = '" + kRun3 +
                                       "';\nDELETE FROM events WHERE run = '" + kRun3 +
                                       "';\nDELETE FROM runs WHERE run = '" + kRun3 + "';\n";
  static const std::vector<Forgery> all{
      {"UPDATE runs SET verdict = 'PASS', causes = '' WHERE run = '" + kRun3 + "';\n",
       {"run " + kRun3 + " was changed"}},
      {"UPDATE metrics SET value = 0.3333 WHERE run = '" + kRun2 + "' AND name = 'rms_px';\n",
       {"run " + kRun2 + " was changed"}},
      {"UPDATE metrics SET gate = 2 WHERE run = '" + kRun3 + "' AND name = 'rms_px';\n",
       {"run " + kRun3 + " was changed"}},
      {"UPDATE images SET sha256 = 'another' WHERE run = '" + kRun1 + "';\n",
       {"run " + kRun1 + " was changed"}},
      {"DELETE FROM images WHERE run = '" + kRun1 + "';\n", {"run " + kRun1 + " was changed"}},
      {"UPDATE runs SET document = replace(document, 'too dark', '') WHERE run = '" + kRun1 +
           "';\n",
       {"run " + kRun1 + " was changed"}},
      {"UPDATE runs SET document = '{' WHERE run = '" + kRun1 + "';\n",
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
    const TrailCheck kept = records.check_trail("");
    EXPECT_THAT(kept.problems, IsEmpty());
    EXPECT_EQ(kept.runs, 3U);
    EXPECT_EQ(kept.entries, 5U);
    run_database_client(where, forgery.sql);
    EXPECT_EQ(records.check_trail("").problems, forgery.problems) << forgery.sql;
    if (!forgery.problems.empty()) continue;
    EXPECT_THAT(
        records.check_trail(kept.last_digest).problems,
        ElementsAre(StartsWith("the entry that was noted, " + kept.last_digest + ", is not in")));
  }
}

TEST(CheckAuditTrail, DetectsEachChangeOfSqliteRecords) {
  const TemporaryFolder folder;
  int count = 0;
  check_forgeries([&] { return (folder / (std::to_string(++count) + ".db")).string(); });
}

/// An earlier last digest remains in the trail unless it is removed.
TEST(CheckAuditTrail, AcceptsEarlierLastDigestAfterNewRun) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  keep_three(where);
  Records records(where);
  const std::string expected_digest = records.check_trail("").last_digest;
  EXPECT_THAT(expected_digest, SizeIs(64));
  records.store_run(make_sample_record(numbered_run_id(4), "d", 0.5));
  const TrailCheck later = records.check_trail(expected_digest);
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
  EXPECT_EQ(Records(file).check_trail("").last_digest,
            Records(server.uri()).check_trail("").last_digest);
}

}  // namespace
}  // namespace vlp
