// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/spool.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>
#include <thread>

#include "numbered_runs.h"
#include "station/database_name.h"
#include "station/sample_records.h"
#include "station/station_config.h"
#include "support/child_process.h"
#include "support/postgres_server.h"
#include "support/random.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

TEST(Spool, DeliversStoredRunsWhenRecordsBecomeReachable) {
  const TemporaryFolder folder;
  const std::string where = (folder / "away/records.db").string();
  Spool spool(folder / "spool", where);
  spool.check_can_store();
  EXPECT_THAT(spool.describe_state(),
              AllOf(StartsWith("runs are queued in the spool: "), HasSubstr("records.db")));
  for (int i = 0; i < 3; ++i) spool.store_run(numbered_run(i));
  spool.deliver_waiting();
  EXPECT_THAT(spool.describe_state(), AllOf(StartsWith("runs are queued in the spool, 3 waiting: "),
                                            HasSubstr("records.db")));
  EXPECT_EQ(spool.find_run_by_id(numbered_run(1).run)->camera, "camera-1");
  EXPECT_FALSE(spool.find_run_by_id("another"));
  // Checks continue with the locally known runs.
  EXPECT_EQ(spool.find_other_user("digest-2-7", "camera-1"),
            (ImageUser{"camera-2", numbered_run(2).run}));
  EXPECT_EQ(spool.find_other_user("digest-2-7", "camera-2"), std::nullopt);
  EXPECT_THAT(spool.describe_state(), HasSubstr("; 1 images were not looked up in the records"));
  EXPECT_FALSE(spool.search_same_images(numbered_run(4)).is_complete);

  fs::create_directory(folder / "away");
  Spool later(folder / "spool", where);
  later.check_can_store();
  EXPECT_EQ(later.describe_state(), "");
  EXPECT_THAT(later.list_waiting_runs(), IsEmpty());
  EXPECT_THAT(whole_runs(where), SizeIs(3));
  EXPECT_EQ(Records(where).find_run_by_id(numbered_run(1).run)->metrics[0].value, 0.1 + 0.2);
  EXPECT_EQ(later.find_other_user("digest-2-7", "camera-1"),
            (ImageUser{"camera-2", numbered_run(2).run}));
  // A voided run owns no image, also while its event waits.
  RunRecord voided_run = numbered_run(2);
  voided_run.events = {make_run_event_now(kVoided, "wrong serial", "Ann")};
  later.store_run(voided_run);
  EXPECT_EQ(later.find_other_user("digest-2-7", "camera-1"), std::nullopt);
  later.deliver_waiting();
  EXPECT_EQ(later.find_other_user("digest-2-7", "camera-1"), std::nullopt);
}

TEST(Spool, FindGoldenUserReturnsOnlyJudgedGoldenRuns) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  Spool spool(folder / "spool", where);
  spool.check_can_store();
  RunRecord golden = numbered_run(1), invalid = numbered_run(2);
  golden.kind = invalid.kind = "golden";
  invalid.verdict = "INVALID";
  for (const RunRecord& run : {numbered_run(0), golden, invalid}) spool.store_run(run);
  for (const std::string state : {"here", "in the records"}) {
    EXPECT_EQ(spool.find_golden_user("digest-1-7"), golden.run) << state;
    EXPECT_EQ(spool.find_golden_user("digest-0-7"), std::nullopt) << "of a unit, " << state;
    EXPECT_EQ(spool.find_golden_user("digest-2-7"), std::nullopt) << "not judged, " << state;
    spool.deliver_waiting();
  }
  EXPECT_THAT(spool.list_waiting_runs(), IsEmpty());
}

/// Two evaluations of the same images are not two measurements.
TEST(Spool, SearchSameImagesReturnsJudgedRunWithSameImages) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  Spool spool(folder / "spool", where);
  spool.check_can_store();
  const RunRecord earlier = numbered_run(1);
  ASSERT_FALSE(earlier.is_verdict_invalid());
  RunRecord again = earlier;
  again.run = numbered_run(2).run;
  for (const std::string state : {"here", "in the records"}) {
    spool.store_run(earlier);
    if (state != "here") spool.deliver_waiting();
    EXPECT_EQ(spool.search_same_images(again).run, earlier.run) << state;
    EXPECT_EQ(spool.search_same_images(earlier).run, std::nullopt) << "itself, " << state;
    RunRecord fewer = again, other = again, camera = again, none = again;
    fewer.images.resize(kImagesOfARun / 2);
    EXPECT_EQ(spool.search_same_images(fewer).run, earlier.run) << state;
    other.images.back().sha256 = "another";
    EXPECT_EQ(spool.search_same_images(other).run, std::nullopt) << "one is new, " << state;
    other.images.back().rejection = "blurred";
    EXPECT_EQ(spool.search_same_images(other).run, earlier.run) << "and not used, " << state;
    camera.camera = "another";
    EXPECT_EQ(spool.search_same_images(camera).run, std::nullopt) << state;
    none.images.clear();
    EXPECT_EQ(spool.search_same_images(none).run, std::nullopt) << state;
  }
  // Images of a run that did not count can be used again.
  RunRecord voided_run = earlier;
  voided_run.events = {make_run_event_now(kVoided, "wrong lamps", "Ann")};
  spool.store_run(voided_run);
  EXPECT_EQ(spool.search_same_images(again).run, std::nullopt);
  RunRecord invalid = numbered_run(3), invalid_again = numbered_run(3);
  invalid.set_causes({{"no captures.csv"}});
  invalid_again.run = numbered_run(4).run;
  spool.store_run(invalid);
  EXPECT_EQ(spool.search_same_images(invalid_again).run, std::nullopt);
  spool.deliver_waiting();
  EXPECT_EQ(spool.search_same_images(again).run, std::nullopt);
  EXPECT_EQ(spool.search_same_images(invalid_again).run, std::nullopt);
}

/// A waiting run with later events is one run.
TEST(Spool, KeepsLaterEventsInWaitingRun) {
  const TemporaryFolder folder;
  const std::string where = (folder / "away/records.db").string();
  Spool spool(folder / "spool", where);
  RunRecord run = numbered_run(1);
  run.events = {make_run_event_now(kHookRequested, "label")};
  spool.store_run(run);
  EXPECT_THAT(list_open_hooks(spool, "station-1"), testing::ElementsAre(run.run));
  EXPECT_THAT(list_open_hooks(spool, "another"), IsEmpty());
  const RunRecord before = run;
  run.events.push_back(make_run_event_now(kHookFailed, "\"exit\" code 3"));
  spool.store_run(run);
  run.events = {before.events[0], make_run_event_now(kHookDone, "")};
  spool.store_run(run);
  EXPECT_THAT(list_open_hooks(spool, "station-1"), IsEmpty());
  spool.deliver_waiting();
  EXPECT_THAT(spool.describe_state(), StartsWith("runs are queued in the spool, 1 waiting"));
  EXPECT_THAT(spool.list_waiting_runs(), SizeIs(1));
  EXPECT_THAT(spool.find_run_by_id(run.run)->events, SizeIs(3));

  fs::create_directory(folder / "away");
  Spool later(folder / "spool", where);
  later.check_can_store();
  EXPECT_EQ(later.describe_state(), "");
  EXPECT_THAT(later.list_waiting_runs(), IsEmpty());
  EXPECT_THAT(whole_runs(where), SizeIs(1));
  const auto kept = later.find_run_by_id(run.run);
  ASSERT_THAT(kept->events, SizeIs(3));
  EXPECT_EQ(kept->events[1].text, "\"exit\" code 3");
  EXPECT_THAT(list_open_hooks(later, "station-1"), IsEmpty());
}

TEST(Spool, DeliversValidRunsDespiteInvalidDocumentInOutbox) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  Spool spool(folder / "spool", where);
  spool.check_can_store();
  for (int i = 1; i <= 2; ++i) spool.store_run(numbered_run(i));
  run_database_client((folder / "spool/outbox.db").string(),
                      "UPDATE runs SET document = '{}' WHERE camera = 'camera-1';\n");
  spool.deliver_waiting();
  EXPECT_EQ(whole_runs(where), std::set<std::string>{numbered_run(2).run});
  EXPECT_THAT(spool.describe_state(), AllOf(StartsWith("runs are queued in the spool, 1 waiting: "),
                                            HasSubstr("outbox.db: run " + numbered_run(1).run +
                                                      " is no run of a station: ")));
}

TEST(Spool, RejectsOutboxThatIsNoDatabaseAndStoresRunInRecords) {
  for (const auto& make : {+[](const fs::path& file) { std::ofstream(file) << "no database\n"; },
                           +[](const fs::path& file) { fs::create_symlink("/dev/zero", file); },
                           +[](const fs::path& file) { ::mkfifo(file.c_str(), 0600); }}) {
    const TemporaryFolder folder;
    const std::string where = (folder / "records.db").string();
    { const Records made(where); }
    fs::create_directory(folder / "spool");
    make(folder / "spool/outbox.db");
    Spool spool(folder / "spool", where);
    const auto names_cause =
        AllOf(HasSubstr("spool/outbox.db: "),
              testing::AnyOf(HasSubstr("is no regular file"), HasSubstr("not a database")));
    EXPECT_THAT(rejection_message([&] { spool.check_can_store(); }), names_cause);
    spool.store_run(numbered_run(1));
    EXPECT_THAT(whole_runs(where), SizeIs(1));
    EXPECT_THAT(spool.describe_state(), names_cause);
  }
}

/// Another program can store an event between delivery and removal.
TEST(Spool, KeepsEventStoredDuringDelivery) {
  const TemporaryFolder folder;
  Records outbox((folder / "outbox.db").string());
  RunRecord run = numbered_run(1);
  outbox.store_run(run, "elsewhere");
  const auto delivered = outbox.find_run_by_id(run.run);
  ASSERT_TRUE(delivered);
  run.events = {make_run_event_now(kHookDone, "")};
  outbox.store_run(run, "elsewhere");
  outbox.remove_delivered(*delivered);
  const auto kept = outbox.find_run_by_id(run.run);
  ASSERT_TRUE(kept);
  EXPECT_THAT(kept->events, SizeIs(1));
  outbox.remove_delivered(*kept);
  EXPECT_FALSE(outbox.find_run_by_id(run.run));
  EXPECT_EQ(outbox.check_trail("").entries, 0U);
}

TEST(Spool, StoresRunInRecordsWhenSpoolFolderCannotBeWritten) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  Spool spool(folder.file("spool", ""), where);
  EXPECT_THAT(rejection_message([&] { spool.check_can_store(); }),
              HasSubstr("spool: cannot be made"));
  { const Records made(where); }
  spool.store_run(numbered_run(1));
  EXPECT_THAT(whole_runs(where), SizeIs(1));
  Spool neither(folder / "spool", (folder / "away/records.db").string());
  EXPECT_THAT(rejection_message([&] { neither.store_run(numbered_run(2)); }),
              AllOf(HasSubstr("spool: a run can be stored neither in the spool"),
                    HasSubstr("away/records.db")));
}

TEST(Spool, DeliversEachRunOnlyToItsOwnDatabase) {
  const TemporaryFolder folder;
  const std::string a = (folder / "a.db").string(), b = (folder / "b.db").string();
  { const Records made_a(a), made_b(b); }
  Spool of_a(folder / "spool", a), of_b(folder / "spool", b);
  of_a.store_run(numbered_run(1));
  of_b.check_can_store();
  EXPECT_THAT(whole_runs(b), IsEmpty());
  EXPECT_THAT(of_b.describe_state(),
              AllOf(StartsWith("1 queued for another database"), HasSubstr("a.db")));
  EXPECT_THAT(of_b.list_waiting_runs(), IsEmpty());
  EXPECT_TRUE(of_b.find_run_by_id(numbered_run(1).run)) << "a run is not judged twice for that";
  EXPECT_EQ(of_b.find_other_user("digest-1-7", "b"), (ImageUser{"camera-1", numbered_run(1).run}));
  of_b.store_run(numbered_run(2));
  of_b.deliver_waiting();
  EXPECT_THAT(whole_runs(b), SizeIs(1));
  // The same records, by another name of the file.
  Spool(folder / "spool", (folder / "spool/../a.db").string()).deliver_waiting();
  EXPECT_EQ(whole_runs(a), std::set<std::string>{numbered_run(1).run});
  EXPECT_EQ(of_b.describe_state(), "");
}

TEST(Spool, KeepsDifferentRunWithSameIdWaiting) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  Spool spool(folder / "spool", where);
  spool.check_can_store();
  spool.store_run(numbered_run(1));
  spool.deliver_waiting();
  spool.store_run(numbered_run(1));  // the same, as after a kill before its file was removed
  spool.deliver_waiting();
  EXPECT_EQ(spool.describe_state(), "");
  RunRecord again = numbered_run(1);
  again.ended_utc = "2026-11-21T14:50:01Z";
  spool.store_run(again);
  spool.store_run(numbered_run(2));
  spool.deliver_waiting();
  EXPECT_THAT(spool.describe_state(), AllOf(StartsWith("runs are queued in the spool, 1 waiting: "),
                                            HasSubstr("has another run " + again.run)));
  EXPECT_THAT(whole_runs(where), SizeIs(2));
  EXPECT_EQ(Records(where).find_run_by_id(again.run)->ended_utc, numbered_run(1).ended_utc);
}

/// A missing file can be on a share that is not mounted.
TEST(Spool, CreatesDatabaseOnlyInCheckCanStore) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  Spool spool(folder / "spool", where);
  spool.store_run(numbered_run(1));
  spool.deliver_waiting();
  EXPECT_FALSE(spool.find_run_by_id("another"));
  EXPECT_THAT(spool.describe_state(), AllOf(StartsWith("runs are queued in the spool, 1 waiting: "),
                                            HasSubstr("records.db: there are no records")));
  EXPECT_FALSE(fs::exists(where));
  Spool(folder / "spool", where).check_can_store();
  EXPECT_THAT(whole_runs(where), SizeIs(1));
}

TEST(Spool, DeliversAllRunsOfConcurrentPrograms) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string();
  Spool spool(folder / "spool", where);
  spool.check_can_store();
  for (int i = 0; i < 25; ++i) spool.store_run(numbered_run(i));
  std::vector<pid_t> children;
  for (int program = 1; program <= 3; ++program) {
    children.push_back(start_child([&, program] {
      Spool own_spool(folder / "spool", where);
      for (int i = 0; i < 5; ++i) {
        own_spool.store_run(numbered_run(100 * program + i));
        own_spool.deliver_waiting();
      }
    }));
  }
  EXPECT_TRUE(end_well(children));
  spool.deliver_waiting();
  EXPECT_EQ(spool.describe_state(), "");
  EXPECT_THAT(whole_runs(where), SizeIs(40));
}

TEST(Spool, ListsStoredAndWaitingRunsByFilter) {
  const TemporaryFolder folder;
  const std::string where = (folder / "records.db").string(), away = (folder / "away.db").string();
  RunRecord night = numbered_run(1), day = numbered_run(2), waiting = numbered_run(3);
  night.operator_name = "Ann";
  night.shift = "night";
  waiting.operator_name = "Bea";
  waiting.ended_utc = "2026-11-21T13:51:01Z";
  for (const RunRecord* run : {&night, &day}) Records(where).store_run(*run);
  Spool spool(folder / "spool", where);
  spool.store_run(waiting);
  const auto expect_three = [&](Spool& runs) {
    EXPECT_THAT(list_ids(runs, {}), testing::ElementsAre(night.run, day.run, waiting.run));
    EXPECT_THAT(list_ids(runs, {.last = 1}), testing::ElementsAre(waiting.run));
    EXPECT_THAT(list_ids(runs, {.operator_name = "Ann"}), testing::ElementsAre(night.run));
    EXPECT_THAT(list_ids(runs, {.shift = "night"}), testing::ElementsAre(night.run));
    EXPECT_THAT(list_ids(runs, {.operator_name = "Bea"}), testing::ElementsAre(waiting.run));
    EXPECT_THAT(list_ids(runs, {.operator_name = "Cat"}), IsEmpty());
    EXPECT_THAT(list_ids(runs, {.until = "2026-11-21T13:51"}), SizeIs(2));
    EXPECT_EQ(runs.require_run(night.run).camera, night.camera);
    EXPECT_EQ(runs.require_run(waiting.run).camera, waiting.camera);
    EXPECT_THROW(runs.require_run("none"), std::invalid_argument);
  };
  expect_three(spool);
  EXPECT_THAT(spool.list_run_summaries({}).back().causes, StartsWith("(waits here) "));
  // A waiting run counts as it waits, with its newer events.
  night.events = {make_run_event_now(kVoided, "wrong serial")};
  spool.store_run(night);
  EXPECT_EQ(spool.list_run_summaries({})[0].voided, "wrong serial");
  spool.deliver_waiting();
  expect_three(spool);
  EXPECT_EQ(spool.list_run_summaries({})[0].voided, "wrong serial");
  EXPECT_THAT(spool.list_run_summaries({}).back().causes, Not(StartsWith("(waits here) ")));
  // Without records, the waiting runs alone.
  fs::rename(where, away);
  Spool offline(folder / "spool", where);
  offline.store_run(waiting);
  EXPECT_THAT(list_ids(offline, {}), testing::ElementsAre(waiting.run));
  EXPECT_EQ(offline.require_run(waiting.run).camera, waiting.camera);
  EXPECT_THROW(offline.records_or_throw(), RecordsUnavailable) << "these are not all";
  EXPECT_FALSE(fs::exists(where)) << "a station makes them";
  EXPECT_THROW(Spool({}, where).records_or_throw(), RecordsUnavailable);
}

}  // namespace
}  // namespace vlp
